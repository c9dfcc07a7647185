//! Remembers what the picture of a finished episode needs.

use std::path::PathBuf;
use std::sync::Arc;

use homing_core::{NavigationState, OccupancyGrid, Odometry, PlanarPose, RgbImage};
use homing_monitor::{EpisodePicture, episode_picture, write_png};

/// Points of a path kept: a day of driving at one point every 5 cm would be fewer.
const PATH_MAX: usize = 100_000;
/// Points nearer than this to the last one are left out, metres.
const PATH_STEP_M: f64 = 0.02;

/// The episode so far.
pub struct Still {
    path: Option<PathBuf>,
    map: Option<Arc<OccupancyGrid>>,
    estimated: Vec<(f64, f64)>,
    driven: Vec<(f64, f64)>,
    shortest: Vec<(f64, f64)>,
    believed: Option<PlanarPose>,
    real: Option<PlanarPose>,
    goal: Option<PlanarPose>,
    goal_estimate: Option<PlanarPose>,
    goal_photo: Option<Arc<RgbImage>>,
    view: Option<Arc<RgbImage>>,
}

impl Still {
    /// Draws into `path` when the episode is over; without a path it only listens.
    pub fn new(path: Option<PathBuf>) -> Self {
        Self {
            path,
            map: None,
            estimated: Vec::new(),
            driven: Vec::new(),
            shortest: Vec::new(),
            believed: None,
            real: None,
            goal: None,
            goal_estimate: None,
            goal_photo: None,
            view: None,
        }
    }

    pub fn truth(&mut self, goal: PlanarPose, shortest: Vec<(f64, f64)>) {
        (self.goal, self.shortest) = (Some(goal), shortest);
    }

    pub fn odometry(&mut self, odometry: &Odometry) {
        let pose = odometry.t_odom_base.planar();
        extend(&mut self.estimated, pose);
        self.believed = Some(pose);
    }

    pub fn truth_pose(&mut self, pose: PlanarPose) {
        extend(&mut self.driven, pose);
        self.real = Some(pose);
    }

    pub fn map(&mut self, map: Arc<OccupancyGrid>) {
        self.map = Some(map);
    }

    pub fn state(&mut self, state: &NavigationState) {
        self.goal_estimate = state.goal.as_ref().map(|g| g.pose);
    }

    pub fn goal(&mut self, photo: Arc<RgbImage>) {
        self.goal_photo = Some(photo);
    }

    pub fn view(&mut self, rgb: Arc<RgbImage>) {
        self.view = Some(rgb);
    }

    /// Draws what is known; without map and views there is nothing to draw.
    pub fn draw(&self, title: &str, success: bool, facts: &[(&str, String)]) -> anyhow::Result<()> {
        let (Some(path), Some(map), Some(goal_photo), Some(final_view)) =
            (&self.path, &self.map, &self.goal_photo, &self.view)
        else {
            return Ok(());
        };
        let picture = episode_picture(&EpisodePicture {
            title,
            success,
            facts: &facts[..facts.len().min(6)],
            map,
            estimated_path_m: &self.estimated,
            true_path_m: &self.driven,
            shortest_path_m: &self.shortest,
            start: PlanarPose::default(),
            end: self.real.or(self.believed).unwrap_or_default(),
            goal: self.goal,
            goal_estimate: self.goal_estimate,
            goal_photo,
            final_view,
        });
        Ok(write_png(&picture, path)?)
    }
}

fn extend(path: &mut Vec<(f64, f64)>, pose: PlanarPose) {
    let far = path.last().is_none_or(|last| pose.distance_to(last.0, last.1) >= PATH_STEP_M);
    if far && path.len() < PATH_MAX {
        path.push((pose.x_m, pose.y_m));
    }
}
