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

impl MultiStep {
    /// The settings that the benchmark runs with.
    pub const DEFAULT: Self = Self { moves_max: 5, settled_m: 0.05, settled_rad: 0.02 };
}

impl Default for MultiStep {
    fn default() -> Self {
        Self::DEFAULT
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

impl UnitStep {
    /// The settings that the benchmark runs with.
    pub const DEFAULT: Self = Self { moves_max: 25, step_m: 1.0, step_m_min: 0.1, bearing_sd_rad_max: 0.5 };
}

impl Default for UnitStep {
    fn default() -> Self {
        Self::DEFAULT
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

#[cfg(test)]
mod tests {
    use core::f64::consts::FRAC_PI_2;

    use homing_core::{Goal, UnseenReason};
    use nalgebra::{Matrix3, Matrix6, Vector3};

    use super::*;

    const TARGET: PlanarPose = PlanarPose { x_m: 3.0, y_m: -1.0, yaw_rad: 0.7 };

    /// A level camera 1.25 m above the floor, a little ahead of the body's middle.
    fn mount() -> Transform<Base, Camera> {
        let r = Matrix3::new(0.0, 0.0, 1.0, -1.0, 0.0, 0.0, 0.0, -1.0, 0.0);
        Transform::from_rotation(&r, Vector3::new(0.1, 0.0, 1.25))
    }

    /// What a perception would say from `at` that sees the target with this much too much distance.
    fn pose_from(at: PlanarPose, scale: f64) -> Sighting {
        let t_odom_base: Transform<Odom, Base> = at.to_transform();
        let t_odom_target: Transform<Odom, Base> = TARGET.to_transform();
        let chain = (t_odom_base * mount()).inverse().isometry() * (t_odom_target * mount()).isometry();
        let mut isometry = chain;
        isometry.translation.vector *= scale;
        let t_camera_goal: Transform<Camera, Goal> = Transform::new(isometry);
        Sighting::Pose { t_camera_goal, covariance: Matrix6::identity(), n_inliers: 50, rms_rad: 0.001 }
    }

    fn bearing_from(at: PlanarPose, sd_rad: f64) -> Sighting {
        Sighting::Bearing {
            bearing_rad: at.bearing_to(TARGET.x_m, TARGET.y_m),
            bearing_sd_rad: sd_rad,
            heading_rad: wrap_angle(TARGET.yaw_rad - at.yaw_rad),
            n_inliers: 50,
        }
    }

    /// Goes wherever it is told to; gives the place at the end, why it ended, and the motions made.
    fn follow(approach: Approach, see: impl Fn(PlanarPose, u32) -> Sighting) -> (PlanarPose, Ending, u32) {
        let (mut refinement, mut at) = (Refinement::new(approach), PlanarPose { x_m: 0.5, y_m: 1.0, yaw_rad: -0.3 });
        for _ in 0..100 {
            let sighting = see(at, refinement.n_moves());
            let look = Look { t_odom_base: at.to_transform(), t_base_camera: mount(), sighting: &sighting };
            match refinement.next(&look) {
                Decision::Move(to) => at = to,
                Decision::Done(ending) => return (at, ending, refinement.n_moves()),
            }
        }
        unreachable!("an approach ends");
    }

    fn off_m(at: PlanarPose) -> f64 {
        at.distance_to(TARGET.x_m, TARGET.y_m)
    }

    #[test]
    fn one_step_leads_to_the_estimated_pose_and_no_farther() {
        let (at, ending, n_moves) = follow(Approach::OneStep, |at, _| pose_from(at, 1.0));
        assert!(off_m(at) < 1e-9 && wrap_angle(at.yaw_rad - TARGET.yaw_rad).abs() < 1e-9, "{at:?}");
        assert_eq!((ending, n_moves), (Ending::Spent, 1));
    }

    #[test]
    fn more_steps_correct_what_the_first_was_off_by() {
        let see = |at, _| pose_from(at, 1.3);
        let (once, ..) = follow(Approach::OneStep, see);
        let (often, ending, n_moves) = follow(Approach::MultiStep(MultiStep::default()), see);
        assert!(off_m(once) > 0.5 && off_m(often) < 0.05, "{} {}", off_m(once), off_m(often));
        assert_eq!(ending, Ending::Settled);
        assert!((2..=5).contains(&n_moves));
    }

    #[test]
    fn unit_steps_close_in_on_a_target_whose_distance_is_not_known() {
        let see = |at: PlanarPose, _| bearing_from(at, 0.01);
        let (at, ending, _) = follow(Approach::UnitStep(UnitStep::default()), see);
        assert!(off_m(at) < 0.2 && wrap_angle(at.yaw_rad - TARGET.yaw_rad).abs() < 1e-9, "{at:?}");
        assert_eq!(ending, Ending::Settled);
        // Perception's own poses serve as directions.
        let (at, ..) = follow(Approach::UnitStep(UnitStep::default()), |at, _| pose_from(at, 2.0));
        assert!(off_m(at) < 0.2, "{at:?}");
    }

    #[test]
    fn what_is_not_seen_is_not_followed() {
        let unseen = Sighting::NotSeen { reason: UnseenReason::NoConsensus };
        let unit = Approach::UnitStep(UnitStep::default());
        for approach in [Approach::OneStep, Approach::MultiStep(MultiStep::default()), unit] {
            let (at, ending, n_moves) = follow(approach, |_, _| unseen.clone());
            assert_eq!((at.x_m, ending, n_moves), (0.5, Ending::NotSeen, 0));
        }
        let vanishes = |at, n| if n == 0 { pose_from(at, 1.0) } else { unseen.clone() };
        assert_eq!(follow(Approach::MultiStep(MultiStep::default()), vanishes).1, Ending::Lost);
        let nearly_there = |at, n| bearing_from(at, if n == 0 { 0.1 } else { FRAC_PI_2 });
        assert_eq!(follow(unit, nearly_there).1, Ending::NoParallax);
    }
}
