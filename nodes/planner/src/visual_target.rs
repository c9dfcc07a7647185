//! Visual target navigation without a map: from one sighting of the target straight to the next place (paper: "Visual
//! Target Navigation", 2.3). The robot goes where the sighting says, looks again, and is told here when to stop.

use homing_core::{Base, Camera, Odom, PlanarPose, Sighting, Transform, wrap_angle};

use crate::angles::ahead;
use crate::goal_filter::camera_azimuth;

/// How sightings become motions.
#[derive(Copy, Clone, Debug, PartialEq)]
pub enum Approach {
    /// One motion to the estimated pose: what the paper evaluates.
    OneStep,
    /// To the estimated pose, and again from there: "multi-step iterations of above procedure".
    MultiStep(MultiStep),
    /// Steps of given length in the estimated direction, where images have no depth: "a unit step size for translation".
    UnitStep(UnitStep),
}

/// Settings of [`Approach::MultiStep`].
#[derive(Copy, Clone, Debug, PartialEq)]
pub struct MultiStep {
    /// Most motions.
    pub moves_max: u32,
    /// A correction below this, metres, ...
    pub settled_m: f64,
    /// ... and this, radians, is not worth a motion: the robot is there.
    pub settled_rad: f64,
}

impl Default for MultiStep {
    fn default() -> Self {
        Self { moves_max: 5, settled_m: 0.05, settled_rad: 0.02 }
    }
}

/// Settings of [`Approach::UnitStep`].
#[derive(Copy, Clone, Debug, PartialEq)]
pub struct UnitStep {
    /// Most motions.
    pub moves_max: u32,
    /// The unit, metres. It is halved whenever the direction turns around: the target lies between the last two places.
    pub step_m: f64,
    /// With a shorter step than this the robot is there, metres.
    pub step_m_min: f64,
    /// A direction less certain than this (one standard deviation, radians) is none: the parallax is too small.
    pub bearing_sd_rad_max: f64,
}

impl Default for UnitStep {
    fn default() -> Self {
        Self { moves_max: 25, step_m: 1.0, step_m_min: 0.1, bearing_sd_rad_max: 0.5 }
    }
}

/// What to do next.
#[derive(Copy, Clone, Debug, PartialEq)]
pub enum Decision {
    /// Go to this pose of the odometry frame and look again.
    Move(PlanarPose),
    /// Stay here.
    Done(Ending),
}

/// Why an approach ended.
#[derive(Copy, Clone, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Ending {
    /// All motions allowed were made.
    Spent,
    /// Another motion would change nothing.
    Settled,
    /// The views are so close together that no direction can be told.
    NoParallax,
    /// The target was not seen from the start.
    NotSeen,
    /// The target was seen, and is not seen any more.
    Lost,
}

/// What was seen, and from where.
#[derive(Copy, Clone, Debug)]
pub struct Look<'a> {
    /// Where the robot stands.
    pub t_odom_base: Transform<Odom, Base>,
    /// Where its camera sits. The target view is taken to be from a camera that sits alike.
    pub t_base_camera: Transform<Base, Camera>,
    /// What perception says of the image taken there.
    pub sighting: &'a Sighting,
}

/// A direction to go in, odometry frame.
struct Direction {
    direction_rad: f64,
    sd_rad: f64,
    /// Heading of the target view.
    yaw_rad: f64,
}

impl Look<'_> {
    /// Where the robot would stand to see what the target view shows, `T_odom_base T_base_camera T_camera_goal
    /// T_base_camera^-1` seen from above; `None` without a full pose.
    #[must_use]
    pub fn target_pose(&self) -> Option<PlanarPose> {
        let Sighting::Pose { t_camera_goal, .. } = self.sighting else { return None };
        let chain = self.t_odom_base.isometry() * self.t_base_camera.isometry() * t_camera_goal.isometry();
        let t_odom_target: Transform<Odom, Base> = Transform::new(chain * self.t_base_camera.inverse().isometry());
        t_odom_target.is_finite().then(|| t_odom_target.planar())
    }

    /// Of a pose only its direction counts.
    fn direction(&self) -> Option<Direction> {
        let here = self.t_odom_base.planar();
        match *self.sighting {
            Sighting::NotSeen { .. } => None,
            Sighting::Bearing { bearing_rad, bearing_sd_rad, heading_rad, .. } => {
                let ahead_rad = here.yaw_rad + camera_azimuth(&self.t_base_camera);
                let sound = [bearing_rad, bearing_sd_rad, heading_rad].iter().all(|angle| angle.is_finite());
                sound.then(|| Direction {
                    direction_rad: wrap_angle(ahead_rad + bearing_rad),
                    sd_rad: bearing_sd_rad,
                    yaw_rad: wrap_angle(here.yaw_rad + heading_rad),
                })
            }
            Sighting::Pose { .. } => {
                let target = self.target_pose()?;
                let direction_rad = libm::atan2(target.y_m - here.y_m, target.x_m - here.x_m);
                Some(Direction { direction_rad, sd_rad: 0.0, yaw_rad: target.yaw_rad })
            }
        }
    }
}

/// An approach in progress.
#[derive(Clone, Debug)]
pub struct Refinement {
    approach: Approach,
    n_moves: u32,
    step_m: f64,
    /// Direction of the last unit step, odometry frame, radians.
    direction_rad: Option<f64>,
    /// The target was seen at least once.
    seen: bool,
}

impl Refinement {
    /// Before the first look.
    #[must_use]
    pub fn new(approach: Approach) -> Self {
        let step_m = if let Approach::UnitStep(unit) = approach { unit.step_m } else { 0.0 };
        Self { approach, n_moves: 0, step_m, direction_rad: None, seen: false }
    }

    /// Motions so far.
    #[must_use]
    pub fn n_moves(&self) -> u32 {
        self.n_moves
    }

    /// What to do after a look.
    pub fn next(&mut self, look: &Look<'_>) -> Decision {
        let decision = match self.approach {
            Approach::OneStep => self.one_step(look),
            Approach::MultiStep(config) => self.multi_step(&config, look),
            Approach::UnitStep(config) => self.unit_step(&config, look),
        };
        self.n_moves += u32::from(matches!(decision, Decision::Move(_)));
        decision
    }

    fn one_step(&self, look: &Look<'_>) -> Decision {
        match look.target_pose() {
            _ if self.n_moves > 0 => Decision::Done(Ending::Spent),
            Some(target) => Decision::Move(target),
            None => Decision::Done(Ending::NotSeen),
        }
    }

    fn multi_step(&mut self, config: &MultiStep, look: &Look<'_>) -> Decision {
        let Some(target) = look.target_pose() else { return self.unseen() };
        let pose = look.t_odom_base.planar();
        self.seen = true;
        let near = pose.distance_to(target.x_m, target.y_m) < config.settled_m
            && wrap_angle(target.yaw_rad - pose.yaw_rad).abs() < config.settled_rad;
        if near {
            Decision::Done(Ending::Settled)
        } else if self.n_moves >= config.moves_max {
            Decision::Done(Ending::Spent)
        } else {
            Decision::Move(target)
        }
    }

    fn unit_step(&mut self, config: &UnitStep, look: &Look<'_>) -> Decision {
        let Some(direction) = look.direction() else { return self.unseen() };
        self.seen = true;
        if direction.sd_rad > config.bearing_sd_rad_max {
            return Decision::Done(Ending::NoParallax);
        }
        let turned = |last: f64| wrap_angle(direction.direction_rad - last).abs() > core::f64::consts::FRAC_PI_2;
        if self.direction_rad.is_some_and(turned) {
            self.step_m *= 0.5;
        }
        self.direction_rad = Some(direction.direction_rad);
        if self.step_m < config.step_m_min {
            return Decision::Done(Ending::Settled);
        }
        if self.n_moves >= config.moves_max {
            return Decision::Done(Ending::Spent);
        }
        let (x_m, y_m) = ahead(&look.t_odom_base.planar(), direction.direction_rad, self.step_m);
        Decision::Move(PlanarPose { x_m, y_m, yaw_rad: direction.yaw_rad })
    }

    fn unseen(&self) -> Decision {
        Decision::Done(if self.seen { Ending::Lost } else { Ending::NotSeen })
    }
}
