//! What one event tells: where the robot is, what is in its way, where the goal may be.

use homing_core::{
    BearingHint, Cell, GoalEstimate, Mode, MotionOutcome, OccupancyGrid, Odometry, OdometryBuffer, PlanarPose,
    Sighting, wrap_angle,
};

use super::{Decision, HINT_STEPS, HINTS_MAX, ODOMETRY_KEPT, Planner, REJECTED_MAX};
use crate::angles::distance;
use crate::event::PlannerObservation;
use crate::evidence::{View, weigh};
use crate::goal_filter::{Doubt, Joined, Sightline, camera_azimuth};
use crate::mapper::Integrated;
use crate::progress::jumped;
use crate::switches::SwitchKind;

impl Planner {
    /// Remembers where the robot is; an impossible reading gives the reason to hold.
    pub(super) fn remember(&mut self, reading: &Odometry) -> Result<(), Decision> {
        let last = self.odometry.latest().copied();
        if !reading.t_odom_base.is_finite() {
            return Err(Decision::hold("the odometry is not a number"));
        }
        if last.is_some_and(|last| reading.stamp.began_anew_after(last.stamp)) {
            self.begin_anew(reading);
        } else if !self.odometry.push(*reading) {
            self.n_rejected += 1;
            if self.n_rejected > REJECTED_MAX {
                self.begin_anew(reading);
            }
            return Err(Decision::hold("the odometry is older than the last"));
        }
        self.n_rejected = 0;
        if last.is_some_and(|last| jumped(&last, reading, &self.config.body)) {
            self.begin_anew(reading);
        }
        self.state.stamp = reading.stamp;
        self.state.pose = reading.t_odom_base.planar();
        Ok(())
    }

    /// Another odometry began: poses and places of the old one mean nothing in it.
    fn begin_anew(&mut self, reading: &Odometry) {
        self.odometry = OdometryBuffer::new(ODOMETRY_KEPT);
        self.odometry.push(*reading);
        self.n_rejected = 0;
        self.begin_map();
        self.restarted = true;
    }

    /// A forward that did not come through is an obstacle that depth does not show.
    pub(super) fn mark_blocked(&mut self, outcome: Option<&MotionOutcome>) {
        let pose = self.state.pose;
        if outcome.is_some_and(|o| self.progress.was_blocked(self.commanded, o, &self.config.body)) {
            let resolution_m = self.config.resolution_m;
            let width_m = self.progress.bump_width_m(resolution_m);
            self.mapper.mark_bump(&pose, self.config.body.radius_m + resolution_m, width_m);
        }
        // Only what is well under the body is known to be free: odometry has errors, and so has its radius.
        self.mapper.mark_visited(&pose, 0.8 * self.config.body.radius_m);
    }

    pub(super) fn map_depth(&mut self, seen: &PlannerObservation) -> Integrated {
        self.mapper.integrate(&seen.depth, &seen.intrinsics, &seen.t_base_camera, &self.state.pose)
    }

    /// Applies an estimate where its image was taken (SLING 3.3, fused over time), and checks the goal against it.
    pub(super) fn fuse(&mut self, observation: &PlannerObservation, estimate: Option<&GoalEstimate>) {
        let Some(estimate) = estimate.filter(|e| Some(e.goal_id) == self.goal_id) else { return };
        let Some(t_odom_base) = self.odometry.at(estimate.stamp) else { return };
        if self.config.switches.kind != SwitchKind::Fused {
            return self.predict(observation, estimate, &t_odom_base);
        }
        let (step, t_base_camera) = (self.state.step, &observation.t_base_camera);
        let pose = t_odom_base.planar();
        let before = self.filter.best(step).map(|h| h.n_fused);
        let (mut agreed, mut names_it) = (false, false);
        match &estimate.sighting {
            Sighting::NotSeen { .. } => {}
            Sighting::Bearing { bearing_rad, bearing_sd_rad, n_inliers, .. } => {
                if !bearing_rad.is_finite() || !bearing_sd_rad.is_finite() {
                    return;
                }
                agreed =
                    self.filter.refine_by_bearing(&t_odom_base, t_base_camera, *bearing_rad, *bearing_sd_rad, step);
                let bearing_rad = wrap_angle(pose.yaw_rad + camera_azimuth(t_base_camera) + bearing_rad);
                self.hint(&pose, bearing_rad, *n_inliers);
            }
            Sighting::Pose { t_camera_goal, covariance, n_inliers, .. } => {
                // Depth tells the floor only in the image that the matches belong to.
                let same = estimate.stamp == observation.odometry.stamp;
                let view = same.then_some(View { depth: &observation.depth, t_base_camera });
                let evidence = weigh(*n_inliers, &estimate.matched_points, &observation.intrinsics, view.as_ref());
                let measured = self.filter.measure(
                    estimate.stamp,
                    &t_odom_base,
                    t_base_camera,
                    t_camera_goal,
                    covariance,
                    evidence,
                );
                let Some(measured) = measured else { return };
                let joined = self.filter.join(&measured, step);
                agreed = joined == Joined::Fused && self.filter.best(step).map(|h| h.n_fused) != before;
                names_it = joined == Joined::Faint;
                if matches!(joined, Joined::Fused | Joined::Opened) {
                    let away = libm::atan2(measured.pose.y_m - pose.y_m, measured.pose.x_m - pose.x_m);
                    self.hint(&pose, away, evidence.n_inliers);
                }
            }
        }
        self.arrival.hear(estimate.stamp, agreed);
        let against = !agreed && !names_it && !matches!(estimate.sighting, Sighting::Bearing { .. });
        if against && self.may_turn_back() && self.doubt(&pose) == Doubt::Refuted {
            self.filter.condemn(step);
            self.arrival.reset();
            self.state.mode = Mode::Explore;
        }
    }

    /// Fuses what was found in an image from before. It speaks for a place, and never against one: nobody looks there now.
    pub(super) fn recall(&mut self, observation: &PlannerObservation, estimate: &GoalEstimate) {
        if Some(estimate.goal_id) != self.goal_id || self.config.switches.kind != SwitchKind::Fused {
            return;
        }
        let Some(t_odom_base) = self.odometry.at(estimate.stamp) else { return };
        let Sighting::Pose { t_camera_goal, covariance, n_inliers, .. } = &estimate.sighting else { return };
        let evidence = weigh(*n_inliers, &estimate.matched_points, &observation.intrinsics, None);
        let t_base_camera = &observation.t_base_camera;
        let measured =
            self.filter.measure(estimate.stamp, &t_odom_base, t_base_camera, t_camera_goal, covariance, evidence);
        let Some(mut measured) = measured else { return };
        self.filter.age(&mut measured, self.odometry.n_since(estimate.stamp));
        self.filter.join(&measured, self.state.step);
    }

    fn doubt(&mut self, pose: &PlanarPose) -> Doubt {
        let Some(best) = self.filter.best(self.state.step) else { return Doubt::None };
        let view = clear_view(self.mapper.map(), (pose.x_m, pose.y_m), (best.pose.x_m, best.pose.y_m));
        self.filter.doubt(pose, view, self.config.switches.n_inliers_min as f64, self.state.step)
    }

    pub(super) fn hint(&mut self, pose: &PlanarPose, bearing_rad: f64, n_inliers: usize) {
        let oldest = self.hinted_at.first().copied();
        if self.hints.len() == HINTS_MAX || oldest.is_some_and(|at| at + HINT_STEPS < self.state.step) {
            self.hints.remove(0);
            self.hinted_at.remove(0);
        }
        let weight = (n_inliers as f64 / self.config.switches.n_inliers_min.max(1) as f64).min(1.0);
        self.hinted_at.push(self.state.step);
        self.hints.push(BearingHint { x_m: pose.x_m, y_m: pose.y_m, bearing_rad, weight });
    }
}

/// Whether an obstacle of the map stands on the straight line between two points.
fn clear_view(map: &OccupancyGrid, from_m: (f64, f64), to_m: (f64, f64)) -> Sightline {
    let n = (distance(from_m, to_m) / map.geometry.resolution_m).ceil().clamp(1.0, 1000.0) as u32;
    let hidden = (1..n).any(|i| {
        let share = f64::from(i) / f64::from(n);
        let (x, y) = (from_m.0 + share * (to_m.0 - from_m.0), from_m.1 + share * (to_m.1 - from_m.1));
        map.geometry.cell_at(x, y).is_some_and(|(c, r)| map.at(c, r) == Cell::Occupied)
    });
    if hidden { Sightline::Hidden } else { Sightline::Clear }
}
