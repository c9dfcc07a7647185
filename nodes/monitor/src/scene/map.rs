//! The map from above: grid, paths, robot, frontiers, goal.

mod legend;

use std::time::Duration;

use homing_core::{Cell, GoalHypothesis, LaserScan, NavigationState, OccupancyGrid, PlanarPose, Sighting};
use nalgebra::{Matrix2, SymmetricEigen, Vector2};
use rerun::components::ImageFormat;
use rerun::datatypes::{ChannelDatatype, ClassDescription, ColorModel, Rgba32};
use rerun::{AnnotationContext, Arrows2D, LineStrips2D, Points2D, SegmentationImage, Transform3D};

use super::{Gate, Logger, points, rgb};
use crate::palette::{Rgb, dark};
use crate::{encode, entities};

/// Points of a path nearer than this to the last one are left out, metres.
const PATH_SPACING_M: f64 = 0.03;
/// A path longer than this many points is thinned to half: every queue is bounded, so is every line.
const PATH_POINTS_MAX: usize = 4096;
/// Length of a bearing's ray, metres: its end is not an estimate of anything.
const BEARING_RAY_M: f64 = 3.0;

pub(super) struct MapScene {
    grid_gate: Gate,
    scan_gate: Gate,
    robot_gate: Gate,
    true_gate: Gate,
    robot_radius_m: f64,
    pose: PlanarPose,
    estimated: Trail,
    truth: Trail,
    legend_at: Option<Transform3D>,
}

impl MapScene {
    pub(super) fn new(log: &Logger, interval: Duration, robot_radius_m: f64) -> Self {
        // The viewer's y axis points down, the floor's up.
        log.show_always(entities::MAP, &Transform3D::from_scale([1.0, -1.0, 1.0]));
        let classes = [
            (Cell::Unknown, "unknown", dark::UNKNOWN),
            (Cell::Free, "free", dark::FREE),
            (Cell::Occupied, "occupied", dark::OCCUPIED),
        ];
        let class = |(cell, name, colour): (Cell, &str, Rgb)| {
            ClassDescription::from((cell as u16, name, Rgba32::from_rgb(colour[0], colour[1], colour[2])))
        };
        log.show_always(entities::GRID, &AnnotationContext::new(classes.map(class)));
        legend::show(log);
        Self {
            grid_gate: Gate::new(interval.max(Duration::from_millis(250))),
            scan_gate: Gate::new(interval),
            robot_gate: Gate::new(interval.min(Duration::from_millis(50))),
            true_gate: Gate::new(interval.min(Duration::from_millis(50))),
            robot_radius_m,
            pose: PlanarPose::default(),
            estimated: Trail::default(),
            truth: Trail::default(),
            legend_at: None,
        }
    }

    /// Distance driven by the robot's own account, metres.
    pub(super) fn driven_m(&self) -> f64 {
        self.estimated.length_m
    }

    pub(super) fn grid(&mut self, log: &Logger, grid: &OccupancyGrid) {
        if !self.grid_gate.opens() {
            return;
        }
        let Some(image) = encode::map_image(grid) else { return };
        let place = placed(image.left_m, image.top_m, image.resolution_m);
        self.show_legend(log, &image);
        let format = ImageFormat::from_color_model(image.size, ColorModel::L, ChannelDatatype::U8);
        let picture = SegmentationImage::new(image.classes, format).with_opacity(1.0).with_draw_order(-10.0);
        log.show_all(entities::GRID, &[&place, &picture]);
    }

    pub(super) fn robot(&mut self, log: &Logger, pose: PlanarPose) {
        self.pose = pose;
        if self.robot_gate.opens() {
            self.show_robot(log);
        }
    }

    pub(super) fn true_robot(&mut self, log: &Logger, pose: PlanarPose) {
        self.truth.push(pose);
        if self.true_gate.opens() {
            log.show(entities::PATH_TRUE, &self.truth.line(2.6, dark::TRUE).with_draw_order(11.0));
            let body = Points2D::new([xy(pose.x_m, pose.y_m)]).with_colors([rgb(dark::TRUE)]);
            log.show(entities::ROBOT_TRUE, &body.with_radii([self.robot_radius_m as f32]).with_draw_order(13.0));
        }
    }

    pub(super) fn navigation(&mut self, log: &Logger, state: &NavigationState) {
        self.pose = state.pose;
        self.show_robot(log);
        let planned = LineStrips2D::new([strip(&state.path_m)]).with_radii([points(1.2)]);
        log.show(entities::PATH_PLANNED, &planned.with_colors([rgb(dark::PLANNED)]).with_draw_order(9.0));
        let frontiers = Points2D::new(strip(&state.frontiers_m)).with_radii([points(4.0)]);
        log.show(entities::FRONTIERS, &frontiers.with_colors([rgb(dark::FRONTIER)]).with_draw_order(8.0));
        let target = Points2D::new(state.target_m.map(|(x, y)| xy(x, y))).with_radii([points(6.0)]);
        log.show(entities::TARGET, &target.with_colors([rgb(dark::TARGET)]).with_draw_order(10.0));
        match &state.goal {
            Some(goal) => show_goal(log, goal),
            None => show_no_goal(log),
        }
    }

    pub(super) fn forget_goal(&mut self, log: &Logger) {
        show_no_goal(log);
        log.show(entities::GOAL_BEARING, &LineStrips2D::clear_fields());
    }

    /// Shows a bearing without distance as a ray from where the robot stands.
    pub(super) fn sighting(&mut self, log: &Logger, sighting: &Sighting) {
        let ray = if let Sighting::Bearing { bearing_rad, .. } = sighting {
            vec![ray(&self.pose, *bearing_rad, BEARING_RAY_M)]
        } else {
            Vec::new()
        };
        let line = LineStrips2D::new(ray).with_radii([points(1.0)]).with_colors([rgb(dark::GOAL)]);
        log.show(entities::GOAL_BEARING, &line);
    }

    pub(super) fn scan(&mut self, log: &Logger, scan: &LaserScan) {
        if !self.scan_gate.opens() {
            return;
        }
        let hits = scan.ranges_m.iter().enumerate().filter(|(_, r)| {
            let range = f64::from(**r);
            range >= scan.range_min_m && range < scan.range_max_m
        });
        let hit = |(i, range): (usize, &f32)| {
            ray(&self.pose, scan.angle_min_rad + i as f64 * scan.angle_increment_rad, f64::from(*range))[1]
        };
        let dots = Points2D::new(hits.map(hit)).with_radii([points(1.0)]).with_colors([rgb(dark::SCAN)]);
        log.show(entities::SCAN, &dots);
    }

    pub(super) fn true_goal(&mut self, log: &Logger, pose: PlanarPose) {
        let mark = Points2D::new([xy(pose.x_m, pose.y_m)]).with_radii([points(5.0)]);
        log.show(entities::GOAL_TRUE, &mark.with_colors([rgb(dark::TRUE)]).with_draw_order(12.0));
        log.show(entities::GOAL_TRUE_HEADING, &arrow(&pose, 0.6, dark::TRUE).with_draw_order(12.0));
    }

    pub(super) fn shortest_path(&mut self, log: &Logger, path: &[(f64, f64)]) {
        let line = LineStrips2D::new([strip(path)]).with_radii([points(1.0)]).with_colors([rgb(dark::SHORTEST)]);
        log.show(entities::PATH_SHORTEST, &line.with_draw_order(7.0));
    }

    /// Keeps the legend below the map, as wide as a map of usual size.
    fn show_legend(&mut self, log: &Logger, map: &encode::MapImage) {
        let scale = map.width_m().clamp(7.0, 12.0) / legend::WIDTH_PX;
        let place = placed(map.left_m, map.bottom_m() - 0.25, scale);
        if self.legend_at.as_ref() != Some(&place) {
            log.show(entities::LEGEND, &place);
            self.legend_at = Some(place);
        }
    }

    fn show_robot(&mut self, log: &Logger) {
        let pose = self.pose;
        self.estimated.push(pose);
        log.show(entities::PATH_ESTIMATED, &self.estimated.line(1.3, dark::ESTIMATED).with_draw_order(14.0));
        let body = Points2D::new([xy(pose.x_m, pose.y_m)]).with_radii([self.robot_radius_m as f32]);
        log.show(entities::ROBOT, &body.with_colors([rgb(dark::ESTIMATED)]).with_draw_order(15.0));
        let heading = arrow(&pose, 2.4 * self.robot_radius_m, dark::TEXT);
        log.show(entities::ROBOT_HEADING, &heading.with_draw_order(16.0));
    }
}

/// Where something has been.
#[derive(Default)]
struct Trail {
    points: Vec<[f32; 2]>,
    last: Option<PlanarPose>,
    length_m: f64,
}

impl Trail {
    fn push(&mut self, pose: PlanarPose) {
        let moved = self.last.map(|last| last.distance_to(pose.x_m, pose.y_m));
        if moved.is_some_and(|d| d < PATH_SPACING_M) || !pose.x_m.is_finite() || !pose.y_m.is_finite() {
            return;
        }
        self.length_m += moved.unwrap_or(0.0);
        self.last = Some(pose);
        if self.points.len() == PATH_POINTS_MAX {
            let mut index = 0;
            self.points.retain(|_| {
                index += 1;
                index % 2 == 1
            });
        }
        self.points.push(xy(pose.x_m, pose.y_m));
    }

    fn line(&self, radius: f32, colour: Rgb) -> LineStrips2D {
        LineStrips2D::new([self.points.clone()]).with_radii([points(radius)]).with_colors([rgb(colour)])
    }
}

fn show_goal(log: &Logger, goal: &GoalHypothesis) {
    let covariance = goal.covariance.fixed_view::<2, 2>(0, 0).into_owned();
    let outline = two_sigma_outline(&goal.pose, covariance);
    let ellipse = LineStrips2D::new([outline]).with_radii([points(1.3)]).with_colors([rgb(dark::GOAL)]);
    let centre = Points2D::new([xy(goal.pose.x_m, goal.pose.y_m)]).with_radii([points(4.0)]);
    let centre = centre.with_colors([rgb(dark::GOAL)]).with_draw_order(17.0);
    log.show(entities::GOAL_ELLIPSE, &ellipse.with_draw_order(17.0));
    log.show(entities::GOAL_CENTRE, &centre);
    log.show(entities::GOAL_HEADING, &arrow(&goal.pose, 0.5, dark::GOAL).with_draw_order(17.0));
}

fn show_no_goal(log: &Logger) {
    log.show(entities::GOAL_ELLIPSE, &LineStrips2D::clear_fields());
    log.show(entities::GOAL_CENTRE, &Points2D::clear_fields());
    log.show(entities::GOAL_HEADING, &Arrows2D::clear_fields());
}

/// The ellipse that holds a position with 86 % (two standard deviations in two dimensions), closed.
fn two_sigma_outline(pose: &PlanarPose, covariance: Matrix2<f64>) -> Vec<[f32; 2]> {
    let eigen = SymmetricEigen::new(covariance);
    let radii = eigen.eigenvalues.map(|variance| 2.0 * variance.max(0.0).sqrt());
    let on_ellipse = |i: usize| {
        let angle = core::f64::consts::TAU * i as f64 / 48.0;
        let p = eigen.eigenvectors * Vector2::new(radii.x * angle.cos(), radii.y * angle.sin());
        xy(pose.x_m + p.x, pose.y_m + p.y)
    };
    (0..=48).map(on_ellipse).collect()
}

/// Puts an image's upper left corner to a point of the map, metres; `side_m` is that of a pixel.
fn placed(left_m: f64, top_m: f64, side_m: f64) -> Transform3D {
    let side = side_m as f32;
    Transform3D::from_translation_scale([left_m as f32, top_m as f32, 0.0], [side, -side, 1.0])
}

fn arrow(pose: &PlanarPose, length_m: f64, colour: Rgb) -> Arrows2D {
    let tip = xy(length_m * pose.yaw_rad.cos(), length_m * pose.yaw_rad.sin());
    Arrows2D::from_vectors([tip])
        .with_origins([xy(pose.x_m, pose.y_m)])
        .with_radii([points(1.5)])
        .with_colors([rgb(colour)])
}

/// Both ends of a ray from the robot, `angle_rad` to the left of its heading.
fn ray(pose: &PlanarPose, angle_rad: f64, length_m: f64) -> [[f32; 2]; 2] {
    let angle = pose.yaw_rad + angle_rad;
    [xy(pose.x_m, pose.y_m), xy(pose.x_m + length_m * angle.cos(), pose.y_m + length_m * angle.sin())]
}

fn strip(path_m: &[(f64, f64)]) -> Vec<[f32; 2]> {
    path_m.iter().map(|&(x, y)| xy(x, y)).collect()
}

fn xy(x: f64, y: f64) -> [f32; 2] {
    [x as f32, y as f32]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_trail_counts_its_length_and_stays_bounded() {
        let mut trail = Trail::default();
        for i in 0..10_000 {
            trail.push(PlanarPose { x_m: 0.05 * f64::from(i), y_m: 0.0, yaw_rad: 0.0 });
        }
        assert!(trail.points.len() <= PATH_POINTS_MAX);
        assert!((trail.length_m - 0.05 * 9999.0).abs() < 1e-6);
        assert_eq!(trail.points.last(), Some(&xy(0.05 * 9999.0, 0.0)));
    }

    #[test]
    fn the_ellipse_reaches_two_standard_deviations_along_its_axes() {
        let outline = two_sigma_outline(&PlanarPose::default(), Matrix2::new(0.25, 0.0, 0.0, 0.01));
        let reach = |axis: usize| outline.iter().map(|p| p[axis].abs()).fold(0.0, f32::max);
        assert!((reach(0) - 1.0).abs() < 0.01 && (reach(1) - 0.2).abs() < 0.01);
    }

    #[test]
    fn a_covariance_that_is_none_draws_a_point() {
        let outline = two_sigma_outline(&PlanarPose::default(), Matrix2::new(-1.0, 0.0, 0.0, -1.0));
        assert!(outline.iter().all(|p| p[0].abs() < 1e-6 && p[1].abs() < 1e-6));
    }
}
