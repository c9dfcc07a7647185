//! Eyes without pictures: depth from the floor plan, and a goal that is found where enough of its photo is in sight.

use std::sync::Arc;

use homing_core::{
    DepthImage, GoalEstimate, Observation, PlanarPose, RgbImage, RgbdFrame, RobotBridge, Sighting, StageTimes,
    Transform, UnseenReason, wrap_angle,
};
use homing_sim::arena::Arena;
use homing_sim::episode::{Episode, Viewpoint, t_world_base};
use homing_sim::laser::LaserSlice;
use homing_sim::simulator::Simulator;
use nalgebra::Matrix6;

use crate::Failure;

/// When the oracle finds the goal.
#[derive(Copy, Clone, Debug)]
pub struct Likeness {
    /// Share of the photo's points that must be in sight.
    pub share: f64,
    /// From at most so many times as far, or as near.
    pub scale: f64,
    /// From directions that differ by less, radians.
    pub turn_rad: f64,
}

/// The floor plan, for the oracle.
pub struct Plan {
    /// What stands at the camera's height.
    outline: LaserSlice,
    /// What the photo shows, world frame, with distance and direction from the goal.
    points: Vec<Point>,
}

struct Point {
    at_m: (f64, f64),
    range_m: f64,
    azimuth_rad: f64,
}

impl Default for Likeness {
    /// Set so that the goal is found as long before or after it came into view as with our own features: 3 steps before in
    /// the median, with quartiles 4 before and with it, and a tenth 27 steps after (40 flats).
    fn default() -> Self {
        Self { share: 0.2, scale: 3.5, turn_rad: 1.0 }
    }
}

/// Columns and rows of the oracle's depth images, and how high its furniture is, metres.
const SIZE: (u32, u32) = (320, 240);
const FURNITURE_M: f64 = 0.8;
const FAR_M: f64 = 15.0;

impl Plan {
    /// Of an episode's flat.
    pub fn new(arena: &Arena, episode: &Episode) -> Self {
        let outline = LaserSlice::new(arena.scene(), arena.grid().floor_z_m() + episode.camera.height_m);
        let (goal, half_rad) = (episode.goal, 0.5 * episode.camera.hfov_rad);
        let points = (0..64)
            .filter_map(|k| {
                let azimuth_rad = goal.yaw_rad + half_rad * (f64::from(k) / 31.5 - 1.0);
                let range_m = outline.range_m((goal.x_m, goal.y_m), azimuth_rad, FAR_M)?;
                let at_m = (goal.x_m + range_m * azimuth_rad.cos(), goal.y_m + range_m * azimuth_rad.sin());
                Some(Point { at_m, range_m, azimuth_rad })
            })
            .collect();
        Self { outline, points }
    }

    /// Depth from the floor plan.
    pub fn observe(&self, arena: &Arena, robot: &Simulator) -> Result<Observation, Failure> {
        let camera = Viewpoint { width: SIZE.0, height: SIZE.1, ..Viewpoint::default() };
        let (intrinsics, pose, grid) = (camera.intrinsics()?, robot.pose_truth(), arena.grid());
        let mut depth = vec![0.0_f32; (SIZE.0 * SIZE.1) as usize];
        for column in 0..SIZE.0 {
            let across = (intrinsics.cx() - f64::from(column)) / intrinsics.fx();
            let azimuth = pose.yaw_rad + across.atan();
            let (sin, cos) = azimuth.sin_cos();
            let wall_m = self.outline.range_m((pose.x_m, pose.y_m), azimuth, FAR_M).unwrap_or(FAR_M);
            let slant = across.hypot(1.0);
            let mut fill = |row: u32, range_m: f64| depth[(row * SIZE.0 + column) as usize] = (range_m / slant) as f32;
            // From below upwards: rows that what stands at each range hides.
            let mut row = SIZE.1;
            let mut range_m = 0.05;
            while range_m < wall_m && row > 0 {
                let (x, y) = (pose.x_m + range_m * cos, pose.y_m + range_m * sin);
                let blocked = grid.geometry().cell_at(x, y).is_some_and(|(c, r)| grid.is_blocked(c, r));
                let height_m = if blocked { FURNITURE_M } else { 0.0 };
                let top = intrinsics.cy() + intrinsics.fy() * (camera.height_m - height_m) * slant / range_m;
                while row > 0 && f64::from(row - 1) >= top {
                    row -= 1;
                    fill(row, range_m);
                }
                range_m += 0.03;
            }
            (0..row).for_each(|row| fill(row, wall_m));
        }
        let depth = Arc::new(DepthImage::from_metres(SIZE.0, SIZE.1, depth)?);
        let rgb = Arc::new(RgbImage::new(SIZE.0, SIZE.1, vec![0; (3 * SIZE.0 * SIZE.1) as usize])?);
        let frame = RgbdFrame::new(robot.now(), rgb, depth, intrinsics)?;
        Ok(Observation { frame, odometry: robot.odometry(), scan: None })
    }

    /// Whether enough of what the photo shows is in sight of a camera at `pose`.
    fn shows(&self, pose: PlanarPose, likeness: &Likeness) -> bool {
        let half_rad = 0.5 * Viewpoint::default().hfov_rad;
        let n = self.points.iter().filter(|p| {
            let (dx, dy) = (p.at_m.0 - pose.x_m, p.at_m.1 - pose.y_m);
            let (range_m, azimuth) = (dx.hypot(dy), dy.atan2(dx));
            wrap_angle(azimuth - pose.yaw_rad).abs() < half_rad
                && wrap_angle(azimuth - p.azimuth_rad).abs() < likeness.turn_rad
                && (range_m / p.range_m).max(p.range_m / range_m) < likeness.scale
                && self.outline.range_m((pose.x_m, pose.y_m), azimuth, range_m - 0.1).is_none()
        });
        n.count() as f64 >= likeness.share * 64.0
    }

    /// The goal's pose, exactly, if it is to be found from here.
    pub fn estimate(&self, arena: &Arena, episode: &Episode, robot: &Simulator, likeness: &Likeness) -> GoalEstimate {
        let pose = robot.pose_truth();
        let t_base_camera = *robot.capabilities().t_base_camera.isometry();
        let placed = |p: PlanarPose| *t_world_base(arena, p).isometry() * t_base_camera;
        let sighting = if self.shows(pose, likeness) {
            Sighting::Pose {
                t_camera_goal: Transform::new(placed(pose).inverse() * placed(episode.goal.into())),
                covariance: Matrix6::identity() * 1e-4,
                n_inliers: 40,
                rms_rad: 1e-3,
            }
        } else {
            Sighting::NotSeen { reason: UnseenReason::TooFewMatches }
        };
        GoalEstimate {
            stamp: robot.now(),
            goal_id: 1,
            sighting,
            n_matches: 0,
            switch_probability: None,
            matched_points: Vec::new(),
            times: StageTimes::default(),
        }
    }
}
