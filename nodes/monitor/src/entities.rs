//! Where everything is logged: the names people read in the viewer.

/// Camera image with the goal photo beside it, pixels of the camera image.
pub(crate) const MATCHES: &str = "matches";
pub(crate) const CAMERA: &str = "matches/camera";
pub(crate) const GOAL_PHOTO: &str = "matches/goal photo";
pub(crate) const MATCH_LINES: &str = "matches/verified";
pub(crate) const MATCH_POINTS: &str = "matches/verified points";
pub(crate) const CAPTIONS: &str = "matches/captions";

/// Depth image, half the camera's resolution.
pub(crate) const DEPTH: &str = "depth";

/// The map seen from above, metres of the odometry frame.
pub(crate) const MAP: &str = "map";
pub(crate) const GRID: &str = "map/grid";
pub(crate) const SCAN: &str = "map/scan";
pub(crate) const FRONTIERS: &str = "map/frontiers";
pub(crate) const PATH_SHORTEST: &str = "map/shortest path";
pub(crate) const PATH_TRUE: &str = "map/true path";
pub(crate) const PATH_ESTIMATED: &str = "map/estimated path";
pub(crate) const PATH_PLANNED: &str = "map/planned path";
pub(crate) const TARGET: &str = "map/target";
pub(crate) const GOAL_TRUE: &str = "map/true goal";
pub(crate) const GOAL_TRUE_HEADING: &str = "map/true goal/heading";
pub(crate) const GOAL_ELLIPSE: &str = "map/goal estimate";
pub(crate) const GOAL_CENTRE: &str = "map/goal estimate/centre";
pub(crate) const GOAL_HEADING: &str = "map/goal estimate/heading";
pub(crate) const GOAL_BEARING: &str = "map/goal bearing";
pub(crate) const ROBOT_TRUE: &str = "map/true robot";
pub(crate) const ROBOT: &str = "map/robot";
pub(crate) const ROBOT_HEADING: &str = "map/robot/heading";
pub(crate) const LEGEND: &str = "map/legend";

/// Plots.
pub(crate) const MODE: &str = "mode";
pub(crate) const LATENCY: &str = "latency";
pub(crate) const COUNTS: &str = "counts";
pub(crate) const MATCH_COUNT: &str = "counts/matches";
pub(crate) const INLIER_COUNT: &str = "counts/verified";

/// Texts.
pub(crate) const LOG: &str = "log";
pub(crate) const SUMMARY: &str = "summary";

/// Timelines.
pub(crate) const STEP: &str = "step";
pub(crate) const ROBOT_TIME: &str = "robot_time";
