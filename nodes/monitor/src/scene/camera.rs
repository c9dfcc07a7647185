//! The camera image beside the goal photo with the verified matches between them, and the depth image.

use std::collections::VecDeque;
use std::sync::Arc;
use std::time::{Duration, Instant};

use homing_core::{DepthImage, GoalEstimate, GoalPhoto, MatchedPoint, RgbImage, RgbdFrame};
use rerun::components::{Colormap, MagnificationFilter, MediaType};
use rerun::{EncodedDepthImage, EncodedImage, LineStrips2D, Points2D, Transform3D};

use super::{Clock, Gate, Logger, points, rgb};
use crate::palette::{dark, ramp};
use crate::{encode, entities};

/// Frames kept until perception's answer to one of them arrives: half a second at 30 Hz.
const FRAMES_KEPT: usize = 16;
/// While estimates arrive at least this often, only frames that an estimate speaks of are shown.
const ESTIMATES_FLOW: Duration = Duration::from_secs(1);
/// More lines than this are a curtain, not a picture.
const LINES_MAX: usize = 70;
/// Each image is fitted into a cell of this size, whatever its own, so that the view's bounds hold for every camera.
const CELL: (f32, f32) = (640.0, 480.0);
/// Between the cells.
const GAP: f32 = 12.0;

/// What the view shows of the space the images lie in: x and y ranges.
pub(crate) const BOUNDS: ([f64; 2], [f64; 2]) = ([-6.0, 2.0 * 640.0 + 12.0 + 6.0], [-44.0, 486.0]);

pub(super) struct CameraScene {
    gate: Gate,
    jpeg_quality: u8,
    frames: VecDeque<Arc<RgbdFrame>>,
    last_estimate: Option<Instant>,
    goal: Option<GoalPhoto>,
    /// Size of the camera image that the goal photo was last laid out beside, pixels.
    laid_out: Option<(u32, u32)>,
}

impl CameraScene {
    pub(super) fn new(_log: &Logger, interval: Duration, jpeg_quality: u8) -> Self {
        Self {
            gate: Gate::new(interval),
            jpeg_quality,
            frames: VecDeque::with_capacity(FRAMES_KEPT),
            last_estimate: None,
            goal: None,
            laid_out: None,
        }
    }

    pub(super) fn goal(&mut self, log: &Logger, photo: GoalPhoto) {
        let size = self.laid_out.take().unwrap_or((640, 480));
        self.goal = Some(photo);
        if let Some(photo) = &self.goal {
            show_jpeg(log, entities::GOAL_PHOTO, &photo.rgb, self.jpeg_quality);
        }
        self.lay_out(log, size);
        self.show_matches(log, &[]);
    }

    pub(super) fn frame(&mut self, log: &Logger, clock: &mut Clock, frame: Arc<RgbdFrame>) {
        if self.frames.len() == FRAMES_KEPT {
            self.frames.pop_front();
        }
        self.frames.push_back(frame.clone());
        let estimates_flow = self.last_estimate.is_some_and(|at| at.elapsed() < ESTIMATES_FLOW);
        if !estimates_flow && self.gate.opens() {
            clock.set(log, frame.stamp);
            self.show_frame(log, &frame);
            self.show_matches(log, &[]);
        }
    }

    /// Shows the estimate over the frame it was made from.
    pub(super) fn estimate(&mut self, log: &Logger, clock: &mut Clock, estimate: &GoalEstimate) {
        self.last_estimate = Some(Instant::now());
        let Some(frame) = self.frames.iter().find(|f| f.stamp == estimate.stamp).cloned() else { return };
        if !self.gate.opens() {
            return;
        }
        clock.set(log, estimate.stamp);
        self.show_frame(log, &frame);
        let speaks_of_goal = self.goal.as_ref().is_some_and(|goal| goal.id == estimate.goal_id);
        self.show_matches(log, if speaks_of_goal { &estimate.matched_points } else { &[] });
    }

    fn show_frame(&mut self, log: &Logger, frame: &RgbdFrame) {
        show_jpeg(log, entities::CAMERA, &frame.rgb, self.jpeg_quality);
        show_depth(log, &frame.depth);
        self.lay_out(log, (frame.rgb.width(), frame.rgb.height()));
    }

    /// Puts camera image and goal photo side by side.
    fn lay_out(&mut self, log: &Logger, camera: (u32, u32)) {
        if self.laid_out == Some(camera) {
            return;
        }
        self.laid_out = Some(camera);
        log.show(entities::CAMERA, &Placement::in_cell(0, camera).transform());
        if let Some(goal) = &self.goal {
            let size = (goal.rgb.width(), goal.rgb.height());
            log.show(entities::GOAL_PHOTO, &Placement::in_cell(1, size).transform());
        }
        let captions = [(0.5 * CELL.0, "what the robot sees"), (1.5 * CELL.0 + GAP, "the photo to drive to")];
        let labels = Points2D::new(captions.map(|(x, _)| [x, -24.0]))
            .with_radii([rerun::Radius::ZERO])
            .with_colors([rgb(dark::TEXT)])
            .with_labels(captions.map(|(_, text)| text))
            .with_show_labels(true);
        log.show(entities::CAPTIONS, &labels);
    }

    fn show_matches(&self, log: &Logger, matches: &[MatchedPoint]) {
        let (Some(camera), Some(goal)) = (self.laid_out, &self.goal) else { return };
        let query = Placement::in_cell(0, camera);
        let photo = Placement::in_cell(1, (goal.rgb.width(), goal.rgb.height()));
        let stride = matches.len().div_ceil(LINES_MAX).max(1);
        let ends = |m: &MatchedPoint| [query.at(m.query_px), photo.at(m.goal_px)];
        let shown: Vec<_> = matches.iter().step_by(stride).map(ends).collect();
        let colours: Vec<_> = shown.iter().map(|[query, _]| rgb(ramp(f64::from(query[1] / CELL.1)))).collect();
        let lines = LineStrips2D::new(shown.iter().copied()).with_radii([points(0.75)]).with_colors(colours);
        log.show(entities::MATCH_LINES, &lines.with_draw_order(20.0));
        let all = matches.iter().flat_map(ends);
        let dots = Points2D::new(all).with_radii([points(1.6)]).with_colors([rgb(dark::TEXT)]);
        log.show(entities::MATCH_POINTS, &dots.with_draw_order(21.0));
    }
}

/// Where an image lies: its upper left corner and the side of a pixel, units of a cell.
struct Placement {
    left: f32,
    top: f32,
    scale: f32,
}

impl Placement {
    /// In the middle of a cell, as large as fits.
    fn in_cell(column: u8, (width, height): (u32, u32)) -> Self {
        let (width, height) = (width as f32, height as f32);
        let scale = (CELL.0 / width).min(CELL.1 / height);
        let left = f32::from(column) * (CELL.0 + GAP) + 0.5 * (CELL.0 - width * scale);
        Self { left, top: 0.5 * (CELL.1 - height * scale), scale }
    }

    fn transform(&self) -> Transform3D {
        Transform3D::from_translation_scale([self.left, self.top, 0.0], [self.scale, self.scale, 1.0])
    }

    /// Of a pixel of the image. Pixel centres are whole numbers to us and halves to the viewer.
    fn at(&self, (x_px, y_px): (f32, f32)) -> [f32; 2] {
        [self.left + (x_px + 0.5) * self.scale, self.top + (y_px + 0.5) * self.scale]
    }
}

fn show_jpeg(log: &Logger, entity: &str, image: &RgbImage, quality: u8) {
    match encode::jpeg(image, quality) {
        Ok(bytes) => log.show(entity, &EncodedImage::new(bytes).with_media_type(MediaType::JPEG)),
        Err(error) => tracing::warn!(entity, %error, "image not shown"),
    }
}

fn show_depth(log: &Logger, depth: &DepthImage) {
    match encode::depth_png(depth) {
        Ok(bytes) => {
            let image = EncodedDepthImage::new(bytes)
                .with_media_type(MediaType::PNG)
                .with_meter(1000.0)
                .with_colormap(Colormap::Turbo)
                .with_depth_range([0.0, 6000.0])
                .with_magnification_filter(MagnificationFilter::Linear);
            log.show(entities::DEPTH, &image);
        }
        Err(error) => tracing::warn!(%error, "depth not shown"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_image_of_any_shape_stays_in_its_cell() {
        for size in [(640, 480), (600, 480), (1920, 1080), (480, 640), (1, 1)] {
            let place = Placement::in_cell(1, size);
            let corner = place.at((size.0 as f32 - 0.5, size.1 as f32 - 0.5));
            assert!(place.left >= CELL.0 + GAP - 0.01 && place.top >= -0.01, "{size:?}");
            assert!(corner[0] <= 2.0 * CELL.0 + GAP + 0.01 && corner[1] <= CELL.1 + 0.01, "{size:?}");
        }
    }
}
