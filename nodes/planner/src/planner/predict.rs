//! Last-mile navigation as the papers have it: one estimate is driven to, nothing is fused, and without recovery there is no
//! way back (the ablations of SLING's table 2).

use homing_core::{Action, Base, GoalEstimate, Mode, Odom, Sighting, Transform, wrap_angle};

use super::{Decision, Planner};
use crate::event::PlannerObservation;
use crate::evidence::Evidence;
use crate::goal_filter::camera_azimuth;
use crate::switches::{Look, LookPose, Recovery, Verdict};

impl Planner {
    /// Looks at one estimate alone. A pose that the switch takes is the new prediction; any other stays a hint for goal
    /// discovery, as a bearing does.
    pub(super) fn predict(
        &mut self,
        observation: &PlannerObservation,
        estimate: &GoalEstimate,
        t_odom_base: &Transform<Odom, Base>,
    ) {
        let (t_base_camera, here) = (&observation.t_base_camera, t_odom_base.planar());
        let mut measured = None;
        match &estimate.sighting {
            Sighting::NotSeen { .. } => {}
            Sighting::Bearing { bearing_rad, n_inliers, .. } if bearing_rad.is_finite() => {
                let bearing_rad = wrap_angle(here.yaw_rad + camera_azimuth(t_base_camera) + bearing_rad);
                self.hint(&here, bearing_rad, *n_inliers);
            }
            Sighting::Bearing { .. } => {}
            Sighting::Pose { t_camera_goal, covariance, n_inliers, .. } => {
                let evidence = Evidence { n_inliers: *n_inliers, n_off_floor: *n_inliers, n_cells: None };
                let stamp = estimate.stamp;
                measured = self.filter.measure(stamp, t_odom_base, t_base_camera, t_camera_goal, covariance, evidence);
            }
        }
        let pose = measured.as_ref().map(|m| LookPose { n_inliers: m.evidence.n_inliers, distance_m: m.range_m });
        let look = Look { pose, probability: estimate.switch_probability };
        let taken = self.config.switches.takes(self.state.mode, &look) == Verdict::Exploit;
        if let Some(measured) = measured {
            if taken {
                self.filter.replace(&measured, self.state.step);
            } else if self.state.mode == Mode::Explore {
                let away = libm::atan2(measured.pose.y_m - here.y_m, measured.pose.x_m - here.x_m);
                self.hint(&here, away, measured.evidence.n_inliers);
            }
        }
        self.arrival.hear(estimate.stamp, taken);
        self.look = Some(look);
    }

    /// Whether last-mile navigation may end in a search: always but on the way to a goal without recovery.
    pub(super) fn may_turn_back(&self) -> bool {
        self.config.switches.recovery == Recovery::On || self.state.mode == Mode::Explore
    }

    /// The end of a one-sided flow of control: wherever this is, it is declared the goal.
    pub(super) fn stop_here(&mut self, why: &str) -> Decision {
        self.state.mode = Mode::Arrived;
        Decision::new(Action::Stop, why)
    }
}
