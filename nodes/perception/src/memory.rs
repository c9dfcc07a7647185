//! What was seen before: a bounded set of keyframes, found again by what they have in common with a photo.
//!
//! Keyframes carry stamps, not poses: whoever keeps odometry knows where each was taken. Retrieval compares descriptors
//! alone and only ranks; whether a keyframe shows the goal is for geometry to say ([`crate::Registration`]).

use homing_core::{Features, Stamp};
use nalgebra::{DMatrix, DMatrixView};

use crate::{PerceptionError, SeenFrame};

/// Strongest keypoints that ask, and that are asked.
const ASKING_MAX: usize = 192;
const ASKED_MAX: usize = 512;
/// Largest ratio of the distances to the nearest and the second nearest descriptor (Lowe 2004, section 7.1).
const RATIO_MAX: f32 = 0.85;

/// How much is remembered.
#[derive(Copy, Clone, Debug, PartialEq)]
pub struct MemoryConfig {
    /// Most keyframes: each takes about 1 MB.
    pub keyframes_max: usize,
    /// A frame this much like one of the newest keyframes tells nothing new, 0 to 1.
    pub likeness_max: f32,
    /// Keyframes that geometry looks at for a new goal.
    pub candidates_max: usize,
}

impl Default for MemoryConfig {
    fn default() -> Self {
        Self { keyframes_max: 64, likeness_max: 0.35, candidates_max: 8 }
    }
}

impl MemoryConfig {
    /// # Errors
    /// [`PerceptionError::Setting`] names the first setting outside its range.
    pub fn check(&self) -> Result<(), PerceptionError> {
        let rules = [
            ("keyframes_max", self.keyframes_max, (0, 4096), "0..=4096"),
            ("candidates_max", self.candidates_max, (0, 256), "0..=256"),
        ];
        for (name, value, (low, high), range) in rules {
            if !(low..=high).contains(&value) {
                return Err(PerceptionError::Setting { name, value: value as f64, range });
            }
        }
        Ok(())
    }
}

/// A frame worth keeping, and how like the keyframe before it is.
#[derive(Clone, Debug)]
struct Keyframe {
    frame: SeenFrame,
    likeness: f32,
}

/// A bounded set of keyframes, in the order they were seen.
#[derive(Clone, Debug)]
pub struct KeyframeMemory {
    config: MemoryConfig,
    keyframes: Vec<Keyframe>,
}

impl KeyframeMemory {
    /// Empty.
    #[must_use]
    pub fn new(config: MemoryConfig) -> Self {
        Self { config, keyframes: Vec::new() }
    }

    /// Keyframes held.
    #[must_use]
    pub fn len(&self) -> usize {
        self.keyframes.len()
    }

    /// True before anything was seen.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.keyframes.is_empty()
    }

    /// Stamp of the newest keyframe.
    #[must_use]
    pub fn newest(&self) -> Option<Stamp> {
        self.keyframes.last().map(|k| k.frame.stamp)
    }

    /// The keyframe with this stamp.
    #[must_use]
    pub fn at(&self, stamp: Stamp) -> Option<&SeenFrame> {
        self.keyframes.iter().map(|k| &k.frame).find(|frame| frame.stamp == stamp)
    }

    /// Forgets everything.
    pub fn clear(&mut self) {
        self.keyframes.clear();
    }

    /// Keeps a frame that shows something new. Where there is no room, the keyframe goes that is most like the one before
    /// it: what was seen once, long ago, stays. Returns whether the frame was kept.
    pub fn remember(&mut self, frame: &SeenFrame) -> bool {
        if self.config.keyframes_max == 0 || frame.features.keypoints.is_empty() {
            return false;
        }
        // Also what was seen two keyframes ago: a robot that looks to and fro shows nothing new.
        let mut newest = self.keyframes.iter().rev().take(3).map(|k| likeness(&frame.features, &k.frame.features));
        let to_last = newest.next().unwrap_or(0.0);
        if newest.fold(to_last, f32::max) > self.config.likeness_max {
            return false;
        }
        if self.keyframes.len() >= self.config.keyframes_max {
            self.forget_one();
        }
        self.keyframes.push(Keyframe { frame: frame.clone(), likeness: to_last });
        true
    }

    /// Stamps of the keyframes that have most in common with a photo, best first, at most
    /// [`MemoryConfig::candidates_max`].
    #[must_use]
    pub fn candidates(&self, goal: &Features) -> Vec<Stamp> {
        let scored = self.keyframes.iter().map(|k| (likeness(goal, &k.frame.features), k.frame.stamp));
        let mut scored: Vec<_> = scored.filter(|(score, _)| *score > 0.0).collect();
        scored.sort_by(|a, b| b.0.total_cmp(&a.0).then(b.1.cmp(&a.1)));
        scored.into_iter().take(self.config.candidates_max).map(|(_, stamp)| stamp).collect()
    }

    fn forget_one(&mut self) {
        let most_alike = |a: &(usize, &Keyframe), b: &(usize, &Keyframe)| a.1.likeness.total_cmp(&b.1.likeness);
        let Some((i, _)) = self.keyframes.iter().enumerate().max_by(most_alike) else { return };
        self.keyframes.remove(i);
        if i > 0 && i < self.keyframes.len() {
            self.keyframes[i].likeness =
                likeness(&self.keyframes[i].frame.features, &self.keyframes[i - 1].frame.features);
        }
    }
}

/// Share of the strongest keypoints of `asking` that have an unmistakable partner among those of `asked`, 0 to 1.
fn likeness(asking: &Features, asked: &Features) -> f32 {
    let Some(distances) = squared_distances(asking, asked) else { return 0.0 };
    let unmistakable = |column: &[f32]| {
        let (mut nearest, mut second) = (f32::INFINITY, f32::INFINITY);
        for &d in column {
            (nearest, second) = if d < nearest { (d, nearest) } else { (nearest, second.min(d)) };
        }
        nearest < RATIO_MAX * RATIO_MAX * second
    };
    let n = distances.column_iter().filter(|column| unmistakable(column.as_slice())).count();
    n as f32 / distances.ncols() as f32
}

/// Squared distances of unit descriptors, one column per asking keypoint, one row per asked. `None` without two to choose
/// from, or if the descriptors are of different kinds.
fn squared_distances(asking: &Features, asked: &Features) -> Option<DMatrix<f32>> {
    let (n_asking, n_asked) = (asking.keypoints.len().min(ASKING_MAX), asked.keypoints.len().min(ASKED_MAX));
    let dimension = asking.dimension;
    if n_asking == 0 || n_asked < 2 || dimension != asked.dimension {
        return None;
    }
    let columns = |features: &Features, n: usize| {
        Some(DMatrixView::from_slice(features.descriptors.get(..n * dimension)?, dimension, n).into_owned())
    };
    let rows = columns(asked, n_asked)?.transpose();
    let mut distances = DMatrix::from_element(n_asked, n_asking, 2.0);
    distances.gemm(-2.0, &rows, &columns(asking, n_asking)?, 1.0);
    Some(distances)
}

#[cfg(test)]
#[expect(clippy::unwrap_used, reason = "tests")]
mod tests {
    use std::sync::Arc;

    use homing_core::{DepthImage, Intrinsics, Keypoint, RgbImage, RgbdFrame};

    use super::*;
    use crate::DepthModel;
    use crate::onnx::descriptors::normalise;

    /// What a robot sees at `place` of a long corridor: 40 landmarks ahead, each with its own descriptor.
    fn view(stamp: u64, place: usize) -> SeenFrame {
        let random = |i: usize| {
            let mixed = (i as u32).wrapping_mul(0x9e37_79b9);
            ((mixed ^ (mixed >> 15)).wrapping_mul(0x85eb_ca6b) >> 8) as f32 / (1 << 24) as f32 - 0.5
        };
        let mut descriptors: Vec<f32> = (place * 32..(place + 40) * 32).map(random).collect();
        descriptors.chunks_exact_mut(32).for_each(normalise);
        let keypoints = vec![Keypoint { x_px: 1.0, y_px: 1.0, score: 1.0 }; 40];
        let features = Features { keypoints, descriptors, dimension: 32, image_size_px: (8, 8) };
        let frame = RgbdFrame::new(
            Stamp(stamp),
            Arc::new(RgbImage::new(8, 8, vec![0; 8 * 8 * 3]).unwrap()),
            Arc::new(DepthImage::from_metres(8, 8, vec![1.0; 64]).unwrap()),
            Intrinsics::from_hfov(8, 8, 1.5).unwrap(),
        );
        SeenFrame::new(&frame.unwrap(), features, &DepthModel::default())
    }

    #[test]
    fn what_was_seen_is_found_again_and_nothing_is_kept_twice() {
        let mut memory = KeyframeMemory::new(MemoryConfig { likeness_max: 0.55, ..MemoryConfig::default() });
        for (stamp, place) in [0, 2, 20, 22, 40, 60, 62, 80].into_iter().enumerate() {
            assert_eq!(memory.remember(&view(stamp as u64, place)), place % 20 == 0, "{place}");
        }
        assert_eq!(memory.len(), 5);
        let photo = view(99, 43).features;
        let candidates = memory.candidates(&photo);
        // Place 40 shares 37 landmarks with the photo, place 60 shares 23, 20 shares 17, 80 shares 3.
        assert_eq!(candidates[..3], [Stamp(4), Stamp(5), Stamp(2)]);
    }

    #[test]
    fn a_full_memory_gives_up_what_it_has_almost_twice() {
        let config = MemoryConfig { keyframes_max: 4, likeness_max: 0.9, candidates_max: 4 };
        let mut memory = KeyframeMemory::new(config);
        for (stamp, place) in [0, 200, 210, 400, 600, 800].into_iter().enumerate() {
            assert!(memory.remember(&view(stamp as u64, place)));
        }
        let kept: Vec<_> = (0..6).filter(|&stamp| memory.at(Stamp(stamp)).is_some()).collect();
        assert_eq!(memory.len(), 4);
        assert!(!kept.contains(&2), "the twin of 1 went first: {kept:?}");
        assert!(kept.contains(&5), "the newest is always kept: {kept:?}");
    }

    #[test]
    fn descriptors_of_another_kind_have_nothing_in_common() {
        let mut memory = KeyframeMemory::new(MemoryConfig::default());
        memory.remember(&view(0, 0));
        let mut other = view(1, 0).features;
        other.dimension = 64;
        assert!(memory.candidates(&other).is_empty());
        other.keypoints.clear();
        assert!(memory.candidates(&other).is_empty());
    }
}
