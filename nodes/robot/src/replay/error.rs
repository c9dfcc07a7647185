//! What can be wrong with a recording, and what to do about it.

use std::path::{Path, PathBuf};

use thiserror::Error;

use crate::depth_rig::DepthRigError;

/// Why a recording, or one frame of it, cannot be used.
#[derive(Debug, Error)]
pub enum RecordingError {
    /// The folder is not there.
    #[error("{}: no such folder; give the folder that holds the frames", directory.display())]
    NoFolder {
        /// What was asked for.
        directory: PathBuf,
    },
    /// The folder holds neither layout.
    #[error(
        "{}: no recording found; expected either frame-000000.color.jpg (or .png), frame-000000.depth.png and \
         frame-000000.pose.txt as in 7-Scenes, or the folders image/ and depth/ with trajectory.log as in Open3D",
        directory.display()
    )]
    UnknownLayout {
        /// The folder.
        directory: PathBuf,
    },
    /// The layout is known but there is not one frame.
    #[error("{}: no frames; is the recording unpacked?", directory.display())]
    NoFrames {
        /// The folder.
        directory: PathBuf,
    },
    /// A frame is not complete.
    #[error("frame {number}: {} is missing; restore it, or remove the frame's other files", file.display())]
    MissingFile {
        /// The frame.
        number: u32,
        /// What is not there.
        file: PathBuf,
    },
    /// The trajectory says nothing about a frame.
    #[error("frame {number} has no pose in {}; restore the entry, or remove the frame's images", file.display())]
    MissingPose {
        /// The frame.
        number: u32,
        /// Where it should be.
        file: PathBuf,
    },
    /// A file cannot be read.
    #[error("{}: cannot be read ({source})", file.display())]
    Unreadable {
        /// The file.
        file: PathBuf,
        /// What the system says.
        source: std::io::Error,
    },
    /// A text file does not hold what it should.
    #[error("{}, line {line}: {what}; restore the file from the data set", file.display())]
    Malformed {
        /// The file.
        file: PathBuf,
        /// Line, from 1.
        line: usize,
        /// What is wrong.
        what: String,
    },
    /// The intrinsics do not describe a camera.
    #[error("{}: {what}", file.display())]
    Intrinsics {
        /// The file.
        file: PathBuf,
        /// What is wrong.
        what: String,
    },
    /// An image has another size than the intrinsics, or is absurdly large.
    #[error(
        "{}: {}x{} pixels, but the intrinsics are for {}x{}; resize neither by hand: take images and intrinsics of one camera",
        file.display(), found.0, found.1, expected.0, expected.1
    )]
    Size {
        /// The image.
        file: PathBuf,
        /// Its columns and rows, by its header.
        found: (u32, u32),
        /// Columns and rows of the intrinsics.
        expected: (u32, u32),
    },
    /// A rig's file that cannot be used.
    #[error(transparent)]
    NoRig(#[from] DepthRigError),
    /// A rig of other cameras.
    #[error(
        "{}: depth images of {}x{} pixels, but the rig's depth camera has {}x{}; give the rig of the cameras that recorded",
        directory.display(), found.0, found.1, expected.0, expected.1
    )]
    Rig {
        /// The folder.
        directory: PathBuf,
        /// Columns and rows of the depth images.
        found: (u32, u32),
        /// Columns and rows of the rig's depth camera.
        expected: (u32, u32),
    },
    /// A depth image is not one.
    #[error("{}: depth must be a 16-bit grey PNG in millimetres, this is {found}", file.display())]
    NotDepth {
        /// The image.
        file: PathBuf,
        /// Its pixel format.
        found: String,
    },
    /// An image is truncated or damaged.
    #[error("{}: cannot be decoded ({what}); the file is damaged, restore it", file.display())]
    Undecodable {
        /// The image.
        file: PathBuf,
        /// What the decoder says.
        what: String,
    },
    /// There is no frame of that number.
    #[error("no frame {number} in {}: it has {count} frames from {first} to {last}", directory.display())]
    NoSuchFrame {
        /// What was asked for.
        number: u32,
        /// The folder.
        directory: PathBuf,
        /// How many there are.
        count: usize,
        /// The first.
        first: u32,
        /// The last.
        last: u32,
    },
}

impl RecordingError {
    pub(super) fn unreadable(file: &Path, source: std::io::Error) -> Self {
        Self::Unreadable { file: file.to_owned(), source }
    }

    pub(super) fn malformed(file: &Path, line: usize, what: impl Into<String>) -> Self {
        Self::Malformed { file: file.to_owned(), line, what: what.into() }
    }
}
