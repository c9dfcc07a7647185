//! Frames as a cheap depth camera gives them: depth beside the colour, and intrinsics of the depth camera for both.

use std::sync::Arc;

use homing_core::{DepthImage, RgbdFrame};

use super::pairs::{PairSource, Unit};
use crate::RunError;

/// The colour camera's focal length, as a share of the one that is said: 525 of 585 pixels of the first Kinect.
const FOCAL: f64 = 525.0 / 585.0;
/// The depth camera sits so far beside the colour camera, metres.
const BASELINE_M: f64 = 0.025;

/// The same pairs with depth that is not registered to the colour: what 7-Scenes and many robots deliver. Poses stay those
/// of the colour camera.
#[derive(Clone, Debug)]
pub struct Unregistered<S>(pub S);

impl<S: PairSource> PairSource for Unregistered<S> {
    fn n_units(&self) -> usize {
        self.0.n_units()
    }

    fn unit(&self, i: usize) -> Result<Unit, RunError> {
        let mut unit = self.0.unit(i)?;
        for posed in &mut unit.frames {
            posed.frame = unregistered(&posed.frame)?;
        }
        Ok(unit)
    }
}

/// The depth of every pixel taken from where the depth camera sees it; what is said of the camera fits the depth.
fn unregistered(frame: &RgbdFrame) -> Result<RgbdFrame, RunError> {
    let (camera, depth) = (&frame.intrinsics, &frame.depth);
    let said = homing_core::Intrinsics::new(
        camera.width(),
        camera.height(),
        camera.fx() / FOCAL,
        camera.fy() / FOCAL,
        camera.cx(),
        camera.cy(),
    )?;
    let mut metres = Vec::with_capacity(depth.width() as usize * depth.height() as usize);
    for v in 0..depth.height() {
        for u in 0..depth.width() {
            let (x, y) = ((f64::from(u) - said.cx()) / said.fx(), (f64::from(v) - said.cy()) / said.fy());
            // Where the ray of the depth camera meets the colour image, with the depth found there in a first look.
            let at = |z_m: f64| {
                let column = camera.cx() + camera.fx() * (x + BASELINE_M / z_m);
                (column.round() as i64, (camera.cy() + camera.fy() * y).round() as i64)
            };
            let look = |(column, row): (i64, i64)| depth.at(u32::try_from(column).ok()?, u32::try_from(row).ok()?);
            let first = look(at(f64::INFINITY));
            metres.push(first.and_then(|z| look(at(f64::from(z)))).unwrap_or(0.0));
        }
    }
    let depth = DepthImage::from_metres(depth.width(), depth.height(), metres).map_err(RunError::Image)?;
    Ok(RgbdFrame::new(frame.stamp, Arc::clone(&frame.rgb), Arc::new(depth), said)?)
}
