//! Colour, depth and intrinsics of one moment, put together by their stamp.

use std::collections::BTreeMap;
use std::sync::Arc;

use homing_core::{DepthImage, FrameSizeError, Intrinsics, RgbImage, RgbdFrame, Stamp};

/// Moments kept while their parts are still arriving.
const WAITING_MAX: usize = 8;

/// Puts the parts of a frame together, in whatever order they arrive.
#[derive(Default)]
pub struct FrameAssembler {
    waiting: BTreeMap<Stamp, Parts>,
    newest_complete: Option<Stamp>,
    dropped: u64,
}

#[derive(Default)]
struct Parts {
    rgb: Option<Arc<RgbImage>>,
    depth: Option<Arc<DepthImage>>,
    intrinsics: Option<Intrinsics>,
}

/// One part.
pub enum Part {
    /// Colour.
    Rgb(RgbImage),
    /// Depth.
    Depth(DepthImage),
    /// Intrinsics.
    Intrinsics(Intrinsics),
}

impl FrameAssembler {
    /// Adds a part. Gives the frame when it is the last one missing. A frame older than one already given is dropped.
    ///
    /// # Errors
    /// [`FrameSizeError`] when the parts do not have one size.
    pub fn add(&mut self, stamp: Stamp, part: Part) -> Result<Option<RgbdFrame>, FrameSizeError> {
        if let Some(newest) = self.newest_complete {
            if stamp.began_anew_after(newest) {
                self.reset();
            } else if stamp <= newest {
                return Ok(None);
            }
        }
        let parts = self.waiting.entry(stamp).or_default();
        match part {
            Part::Rgb(rgb) => parts.rgb = Some(Arc::new(rgb)),
            Part::Depth(depth) => parts.depth = Some(Arc::new(depth)),
            Part::Intrinsics(intrinsics) => parts.intrinsics = Some(intrinsics),
        }
        if let (Some(rgb), Some(depth), Some(intrinsics)) = (&parts.rgb, &parts.depth, parts.intrinsics) {
            let frame = RgbdFrame::new(stamp, Arc::clone(rgb), Arc::clone(depth), intrinsics);
            self.newest_complete = Some(stamp);
            let incomplete = self.waiting.range(..stamp).count();
            self.dropped += incomplete as u64;
            self.waiting = self.waiting.split_off(&stamp);
            self.waiting.remove(&stamp);
            return frame.map(Some);
        }
        if self.waiting.len() > WAITING_MAX {
            self.waiting.pop_first();
            self.dropped += 1;
        }
        Ok(None)
    }

    /// Moments whose parts never all came.
    #[must_use]
    pub fn dropped(&self) -> u64 {
        self.dropped
    }

    /// Forget everything: the robot's clock began anew.
    fn reset(&mut self) {
        *self = Self { dropped: self.dropped, ..Self::default() };
    }
}
