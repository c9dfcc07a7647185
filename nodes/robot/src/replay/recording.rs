//! A recorded sequence, indexed when opened and decoded when asked for.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use homing_core::{Camera, DepthImage, Frame, Goal, Intrinsics, RgbImage, RgbdFrame, Stamp, Transform};

use super::error::RecordingError;
use super::{decode, open3d, seven_scenes};
use crate::depth_rig::{DepthCamera, DepthRig};

/// The frame in which a recording's camera poses are given. Which way is up in it is not known.
#[derive(Copy, Clone, Debug, PartialEq, Eq)]
pub struct World;

impl Frame for World {
    const NAME: &'static str = "recording_world";
}

/// How a recording is laid out on disk.
#[derive(Copy, Clone, Debug, PartialEq, Eq)]
pub enum Layout {
    /// Microsoft 7-Scenes. Depth is not registered to colour; without a rig both are treated as the depth camera's image.
    SevenScenes,
    /// Open3D's reconstruction system.
    Open3d,
}

/// A recorded sequence: poses in memory, images on disk.
#[derive(Clone, Debug)]
pub struct Recording {
    directory: PathBuf,
    layout: Layout,
    intrinsics: Intrinsics,
    entries: BTreeMap<u32, Entry>,
    /// Where depth was taken by a camera of its own.
    rig: Option<DepthRig>,
}

/// One frame on disk.
#[derive(Clone, Debug)]
pub(super) struct Entry {
    pub(super) colour: PathBuf,
    pub(super) depth: PathBuf,
    pub(super) t_world_camera: Transform<World, Camera>,
}

const FRAMES_PER_SECOND: u64 = 30;

impl Recording {
    /// Finds out the layout and reads all poses; images are read by [`Self::frame`].
    ///
    /// # Errors
    /// [`RecordingError`] when the folder is missing or holds no recording, when a frame lacks its colour, depth or pose,
    /// and when poses or intrinsics are malformed.
    pub fn open(directory: impl AsRef<Path>) -> Result<Self, RecordingError> {
        let directory = directory.as_ref().to_owned();
        if !directory.is_dir() {
            return Err(RecordingError::NoFolder { directory });
        }
        let names = list(&directory)?;
        let (layout, intrinsics, entries) = if seven_scenes::is_here(&names) {
            let entries = seven_scenes::entries(&directory, &names)?;
            (Layout::SevenScenes, seven_scenes::intrinsics(&directory)?, entries)
        } else if open3d::is_here(&directory) {
            (Layout::Open3d, open3d::intrinsics(&directory)?, open3d::entries(&directory)?)
        } else {
            return Err(RecordingError::UnknownLayout { directory });
        };
        if entries.is_empty() {
            return Err(RecordingError::NoFrames { directory });
        }
        Ok(Self { directory, layout, intrinsics, entries, rig: None })
    }

    /// Opens a recording; with a rig's file its depth is registered to the colour.
    ///
    /// # Errors
    /// As [`Self::open`], [`DepthRig::read`] and [`Self::with_rig`].
    pub fn open_with(directory: impl AsRef<Path>, rig: Option<&Path>) -> Result<Self, RecordingError> {
        let recording = Self::open(directory)?;
        match rig {
            None => Ok(recording),
            Some(file) => recording.with_rig(DepthRig::read(file)?),
        }
    }

    /// The same recording, of which it is known that a camera beside the colour camera took the depth: depth is registered
    /// to the colour, the intrinsics are the colour camera's, and recorded poses, the depth camera's, become its own.
    ///
    /// # Errors
    /// [`RecordingError::Rig`] when the depth images are of another size than the rig's.
    pub fn with_rig(mut self, rig: DepthRig) -> Result<Self, RecordingError> {
        let size = |camera: &Intrinsics| (camera.width(), camera.height());
        if size(&rig.depth) != size(&self.intrinsics) {
            return Err(RecordingError::Rig {
                directory: self.directory,
                found: size(&self.intrinsics),
                expected: size(&rig.depth),
            });
        }
        for entry in self.entries.values_mut() {
            let t_world_depth: Transform<World, DepthCamera> = Transform::new(*entry.t_world_camera.isometry());
            entry.t_world_camera = t_world_depth * rig.t_camera_depth.inverse();
        }
        self.intrinsics = rig.colour;
        self.rig = Some(rig);
        Ok(self)
    }

    /// Where it lies.
    #[must_use]
    pub fn directory(&self) -> &Path {
        &self.directory
    }

    /// How it is laid out.
    #[must_use]
    pub fn layout(&self) -> Layout {
        self.layout
    }

    /// The camera of every frame.
    #[must_use]
    pub fn intrinsics(&self) -> Intrinsics {
        self.intrinsics
    }

    /// The numbers under which frames were recorded, ascending.
    pub fn numbers(&self) -> impl ExactSizeIterator<Item = u32> + '_ {
        self.entries.keys().copied()
    }

    /// How many frames there are.
    #[must_use]
    pub fn len(&self) -> usize {
        self.entries.len()
    }

    /// Never: a recording without frames does not open.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.entries.is_empty()
    }

    /// When a frame was taken: its number at 30 frames a second.
    #[must_use]
    pub fn stamp(number: u32) -> Stamp {
        Stamp(u64::from(number) * 1_000_000_000 / FRAMES_PER_SECOND)
    }

    /// Reads and decodes one frame.
    ///
    /// # Errors
    /// [`RecordingError`] when there is no such frame, or its images are damaged, of another size than the intrinsics or
    /// not of the right kind.
    pub fn frame(&self, number: u32) -> Result<RgbdFrame, RecordingError> {
        let entry = self.entry(number)?;
        let size = (self.intrinsics.width(), self.intrinsics.height());
        let rgb = Arc::new(self.colour(number)?);
        let depth = Arc::new(match &self.rig {
            None => decode::depth(&entry.depth, size)?,
            Some(rig) => self.registered(rig, &entry.depth)?,
        });
        // Both were checked to have this size.
        Ok(RgbdFrame { stamp: Self::stamp(number), rgb, depth, intrinsics: self.intrinsics })
    }

    /// The colour of a frame alone: what a photo taken there shows.
    ///
    /// # Errors
    /// As [`Self::frame`].
    pub fn colour(&self, number: u32) -> Result<RgbImage, RecordingError> {
        decode::colour(&self.entry(number)?.colour, (self.intrinsics.width(), self.intrinsics.height()))
    }

    /// Recorded pose of the camera at a frame.
    ///
    /// # Errors
    /// [`RecordingError::NoSuchFrame`].
    pub fn t_world_camera(&self, number: u32) -> Result<Transform<World, Camera>, RecordingError> {
        Ok(self.entry(number)?.t_world_camera)
    }

    /// What perception should find: the pose of the camera at `goal` in the camera at `query`.
    ///
    /// # Errors
    /// [`RecordingError::NoSuchFrame`].
    pub fn relative_pose_truth(&self, query: u32, goal: u32) -> Result<Transform<Camera, Goal>, RecordingError> {
        let (t_world_query, t_world_goal) = (self.t_world_camera(query)?, self.t_world_camera(goal)?);
        // The goal camera is the camera itself at another time: the type changes, the numbers do not.
        let t_world_goal: Transform<World, Goal> = Transform::new(*t_world_goal.isometry());
        Ok(t_world_query.inverse() * t_world_goal)
    }

    /// Pairs (query, goal) `gap` original frames apart, a query at every `stride`-th original frame from the first, where
    /// both are stored. A stride of 0 counts as 1.
    #[must_use]
    pub fn pairs(&self, gap: u32, stride: u32) -> Vec<(u32, u32)> {
        let first = self.entries.keys().next().copied().unwrap_or(0);
        let starts = self.numbers().filter(|query| (query - first) % stride.max(1) == 0);
        let pair = |query: u32| Some((query, query.checked_add(gap)?));
        starts.filter_map(pair).filter(|(_, goal)| self.entries.contains_key(goal)).collect()
    }

    fn registered(&self, rig: &DepthRig, file: &Path) -> Result<DepthImage, RecordingError> {
        let expected = (rig.depth.width(), rig.depth.height());
        let depth = decode::depth(file, expected)?;
        rig.register(&depth).map_err(|_| RecordingError::Rig {
            directory: self.directory.clone(),
            found: (depth.width(), depth.height()),
            expected,
        })
    }

    fn entry(&self, number: u32) -> Result<&Entry, RecordingError> {
        self.entries.get(&number).ok_or_else(|| RecordingError::NoSuchFrame {
            number,
            directory: self.directory.clone(),
            count: self.entries.len(),
            first: self.entries.keys().next().copied().unwrap_or(0),
            last: self.entries.keys().next_back().copied().unwrap_or(0),
        })
    }
}

/// Names of the files in a folder, sorted, so that nothing depends on the file system's order.
pub(super) fn list(folder: &Path) -> Result<Vec<String>, RecordingError> {
    let unreadable = |source| RecordingError::unreadable(folder, source);
    let mut names = Vec::new();
    for entry in std::fs::read_dir(folder).map_err(unreadable)? {
        names.push(entry.map_err(unreadable)?.file_name().to_string_lossy().into_owned());
    }
    names.sort();
    Ok(names)
}
