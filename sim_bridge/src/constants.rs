//! The benchmark's frozen numbers, in one place. Changing one makes old results incomparable.

use core::f64::consts::PI;

/// Columns of the robot's camera (NRNS and SLING, habitat configuration).
pub const CAMERA_WIDTH: u32 = 640;
/// Rows of the robot's camera.
pub const CAMERA_HEIGHT: u32 = 480;
/// Horizontal field of view of the robot's camera, radians (120 degrees; NRNS and SLING).
pub const CAMERA_HFOV_RAD: f64 = 120.0 * PI / 180.0;
/// Height of the robot's camera above the floor, metres; it looks straight ahead.
pub const CAMERA_HEIGHT_M: f64 = 1.25;
/// Radius of the robot, metres.
pub const RADIUS_M: f64 = 0.18;
/// Height of the robot, metres.
pub const HEIGHT_M: f64 = 1.5;
/// One step forward, metres (NRNS).
pub const FORWARD_M: f64 = 0.25;
/// One turn, radians (15 degrees; NRNS).
pub const TURN_RAD: f64 = 15.0 * PI / 180.0;
/// Actions an episode may take, the stop included.
pub const STEPS_MAX: u64 = 500;
/// Success is stopping within this geodesic distance of the goal, metres.
pub const SUCCESS_M: f64 = 1.0;
/// An episode is curved if its geodesic distance is at least so many times the straight one (NRNS) ...
pub const CURVED_RATIO: f64 = 1.2;
/// ... or if start and goal headings differ by at least this, radians (45 degrees; NRNS).
pub const CURVED_HEADING_RAD: f64 = 45.0 * PI / 180.0;
/// Median depth along the horizon of a goal view must exceed this, metres, so that no photo shows a bare wall from close by.
pub const GOAL_DEPTH_M_MIN: f64 = 0.6;
/// Height of the laser scanner above the floor, metres.
pub const LASER_HEIGHT_M: f64 = 0.3;
