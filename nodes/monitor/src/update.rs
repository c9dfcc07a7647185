//! What a recorder can be told, in the vocabulary of the control loop.

use std::sync::Arc;

use homing_core::{
    GoalEstimate, GoalPhoto, LaserScan, NavigationState, OccupancyGrid, Odometry, PlanarPose, RgbdFrame, Stamp,
};

/// How much a log line matters.
#[derive(Copy, Clone, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Level {
    /// For whoever looks for a fault.
    Debug,
    /// What happens.
    Info,
    /// Something is missing or was dropped, and the episode goes on.
    Warn,
    /// Something failed.
    Error,
}

/// One thing to show. Cheap to make and to move: large parts are shared or boxed.
#[derive(Clone, Debug)]
pub enum Update {
    /// Colour and depth from the robot's camera.
    Frame(Arc<RgbdFrame>),
    /// The photo to drive to. A new one starts a new goal.
    Goal(GoalPhoto),
    /// What perception found in a frame. Its matches are drawn over the frame with the same stamp.
    Estimate(Box<GoalEstimate>),
    /// The planner's state after a step. Sets the `step` timeline.
    Navigation(Box<NavigationState>),
    /// The occupancy map, odometry frame.
    Map(Arc<OccupancyGrid>),
    /// Where the robot believes it is.
    Odometry(Odometry),
    /// A laser scan, base frame.
    Scan(Arc<LaserScan>),
    /// Where the robot really is, in odometry coordinates. Privileged: only a simulator or a tracker knows it.
    TruthPose {
        /// When it holds.
        stamp: Stamp,
        /// Position and heading of the base, odometry frame.
        pose: PlanarPose,
    },
    /// Where the goal really is, in odometry coordinates. Privileged.
    TruthGoal(PlanarPose),
    /// The shortest way from start to goal, points (x, y) in metres, odometry frame. Privileged.
    ShortestPath(Vec<(f64, f64)>),
    /// How long something took.
    Latency {
        /// What took that long: a short name, the same each time (`perception`, `planner`, `camera to action`).
        name: String,
        /// Milliseconds.
        ms: f64,
    },
    /// A line for the log.
    Log {
        /// How much it matters.
        level: Level,
        /// Who says it: a process or a part of one (`planner`).
        source: String,
        /// One line.
        text: String,
    },
    /// How the episode ended, in Markdown. Replaces the running summary.
    Verdict(String),
}

impl From<GoalEstimate> for Update {
    fn from(estimate: GoalEstimate) -> Self {
        Update::Estimate(Box::new(estimate))
    }
}

impl From<NavigationState> for Update {
    fn from(state: NavigationState) -> Self {
        Update::Navigation(Box::new(state))
    }
}

impl From<OccupancyGrid> for Update {
    fn from(map: OccupancyGrid) -> Self {
        Update::Map(Arc::new(map))
    }
}

impl From<LaserScan> for Update {
    fn from(scan: LaserScan) -> Self {
        Update::Scan(Arc::new(scan))
    }
}

impl From<Arc<RgbdFrame>> for Update {
    fn from(frame: Arc<RgbdFrame>) -> Self {
        Update::Frame(frame)
    }
}

impl From<GoalPhoto> for Update {
    fn from(photo: GoalPhoto) -> Self {
        Update::Goal(photo)
    }
}

impl From<Odometry> for Update {
    fn from(odometry: Odometry) -> Self {
        Update::Odometry(odometry)
    }
}
