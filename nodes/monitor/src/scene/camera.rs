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
/// Between the images, pixels of the camera image.
const GAP_PX: f32 = 12.0;

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
        log.clear(entities::MATCH_LINES);
        log.clear(entities::MATCH_POINTS);
        if let Some(photo) = &self.goal {
            show_jpeg(log, entities::GOAL_PHOTO, &photo.rgb, self.jpeg_quality);
        }
        self.lay_out(log, size);
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

    /// Puts the goal photo to the right of the camera image, scaled to its height.
    fn lay_out(&mut self, log: &Logger, camera: (u32, u32)) {
        if self.laid_out == Some(camera) {
            return;
        }
        self.laid_out = Some(camera);
        let mut captions = vec![([0.5 * camera.0 as f32, -20.0], "what the robot sees")];
        if let Some((offset, scale)) = self.goal_placement() {
            let place = Transform3D::from_translation_scale([offset, 0.0, 0.0], [scale, scale, 1.0]);
            log.show(entities::GOAL_PHOTO, &place);
            let width = self.goal.as_ref().map_or(0.0, |goal| goal.rgb.width() as f32 * scale);
            captions.push(([offset + 0.5 * width, -20.0], "the photo to drive to"));
        }
        let labels = Points2D::new(captions.iter().map(|(at, _)| *at))
            .with_radii([rerun::Radius::ZERO])
            .with_colors([rgb(dark::TEXT)])
            .with_labels(captions.iter().map(|(_, text)| *text))
            .with_show_labels(true);
        log.show(entities::CAPTIONS, &labels);
    }

    /// Offset (camera pixels) and scale of the goal photo.
    fn goal_placement(&self) -> Option<(f32, f32)> {
        let (width, height) = self.laid_out?;
        let goal = self.goal.as_ref()?;
        Some((width as f32 + GAP_PX, height as f32 / goal.rgb.height() as f32))
    }

    fn show_matches(&self, log: &Logger, matches: &[MatchedPoint]) {
        let Some((offset, scale)) = self.goal_placement() else { return };
        let height = self.laid_out.map_or(1.0, |(_, height)| f64::from(height));
        let stride = matches.len().div_ceil(LINES_MAX).max(1);
        // Pixel centres are whole numbers to us and halves to the viewer.
        let ends = |m: &MatchedPoint| {
            let query = [m.query_px.0 + 0.5, m.query_px.1 + 0.5];
            [query, [offset + (m.goal_px.0 + 0.5) * scale, (m.goal_px.1 + 0.5) * scale]]
        };
        let shown: Vec<_> = matches.iter().step_by(stride).map(ends).collect();
        let colours: Vec<_> = shown.iter().map(|[query, _]| rgb(ramp(f64::from(query[1]) / height))).collect();
        let lines = LineStrips2D::new(shown.iter().copied()).with_radii([points(0.75)]).with_colors(colours);
        log.show(entities::MATCH_LINES, &lines.with_draw_order(20.0));
        let all = matches.iter().flat_map(ends);
        let dots = Points2D::new(all).with_radii([points(1.6)]).with_colors([rgb(dark::TEXT)]);
        log.show(entities::MATCH_POINTS, &dots.with_draw_order(21.0));
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
