//! The planner's state <-> homing_msgs/NavigationState.

use homing_core::{Action, Frame, GoalHypothesis, Mode, NavigationState, Odom, PlanarPose};
use nalgebra::Matrix3;

use super::{Malformed, ToDomain, ToMessage, finite, header, stamp, time};
use crate::interfaces::homing_msgs;

const NAME: &str = "homing_msgs/NavigationState";
const MODES: [Mode; 6] = [Mode::Idle, Mode::Explore, Mode::Exploit, Mode::Align, Mode::Arrived, Mode::Failed];
const ACTIONS: [Action; 5] = [Action::Forward, Action::TurnLeft, Action::TurnRight, Action::Stop, Action::Hold];
const FACE: u8 = 5;

impl ToMessage<homing_msgs::NavigationState> for NavigationState {
    fn to_message(&self) -> homing_msgs::NavigationState {
        let index = |at: Option<usize>| at.unwrap_or_default() as u8;
        let flat = |points: &[(f64, f64)]| points.iter().flat_map(|p| [p.0, p.1]).collect();
        let (action, face_mrad) = match self.action {
            Action::Face { milliradians } => (FACE, milliradians),
            other => (index(ACTIONS.iter().position(|a| *a == other)), 0),
        };
        let target = self.target_m.unwrap_or_default();
        let mut message = homing_msgs::NavigationState {
            header: header(self.stamp, Odom::NAME),
            step: self.step,
            mode: index(MODES.iter().position(|m| *m == self.mode)),
            action,
            face_mrad,
            x_m: self.pose.x_m,
            y_m: self.pose.y_m,
            yaw_rad: self.pose.yaw_rad,
            goal_known: self.goal.is_some(),
            has_target: self.target_m.is_some(),
            target_x_m: target.0,
            target_y_m: target.1,
            path_m: flat(&self.path_m),
            frontiers_m: flat(&self.frontiers_m),
            reason: self.reason.clone(),
            ..Default::default()
        };
        if let Some(goal) = &self.goal {
            (message.goal_x_m, message.goal_y_m, message.goal_yaw_rad) =
                (goal.pose.x_m, goal.pose.y_m, goal.pose.yaw_rad);
            message.goal_covariance.copy_from_slice(goal.covariance.transpose().as_slice());
            message.goal_n_fused = u32::try_from(goal.n_fused).unwrap_or(u32::MAX);
            message.goal_last_seen = time(goal.last_seen);
        }
        message
    }
}

impl ToDomain<NavigationState> for homing_msgs::NavigationState {
    fn to_domain(&self) -> Result<NavigationState, Malformed> {
        let mode = MODES
            .get(usize::from(self.mode))
            .ok_or_else(|| Malformed::new(NAME, format!("mode {} does not exist", self.mode)))?;
        let face = (self.action == FACE).then_some(Action::Face { milliradians: self.face_mrad });
        let action = (face.or_else(|| ACTIONS.get(usize::from(self.action)).copied()))
            .ok_or_else(|| Malformed::new(NAME, format!("action {} does not exist", self.action)))?;
        Ok(NavigationState {
            stamp: stamp(&self.header.stamp, NAME)?,
            step: self.step,
            mode: *mode,
            action,
            pose: pose(self.x_m, self.y_m, self.yaw_rad)?,
            goal: if self.goal_known { Some(goal(self)?) } else { None },
            target_m: if self.has_target { Some(target(self)?) } else { None },
            path_m: pairs(&self.path_m, "path_m")?,
            frontiers_m: pairs(&self.frontiers_m, "frontiers_m")?,
            reason: self.reason.clone(),
        })
    }
}

fn target(message: &homing_msgs::NavigationState) -> Result<(f64, f64), Malformed> {
    Ok((finite(message.target_x_m, "target_x_m", NAME)?, finite(message.target_y_m, "target_y_m", NAME)?))
}

fn pairs(flat: &[f64], field: &str) -> Result<Vec<(f64, f64)>, Malformed> {
    let (points, rest) = flat.as_chunks::<2>();
    if !rest.is_empty() {
        return Err(Malformed::new(NAME, format!("{field} has {} numbers, which make no pairs", flat.len())));
    }
    points.iter().map(|[x, y]| Ok((finite(*x, field, NAME)?, finite(*y, field, NAME)?))).collect()
}

fn goal(message: &homing_msgs::NavigationState) -> Result<GoalHypothesis, Malformed> {
    for value in message.goal_covariance {
        finite(value, "goal_covariance", NAME)?;
    }
    Ok(GoalHypothesis {
        pose: pose(message.goal_x_m, message.goal_y_m, message.goal_yaw_rad)?,
        covariance: Matrix3::from_row_slice(&message.goal_covariance),
        n_fused: message.goal_n_fused as usize,
        last_seen: stamp(&message.goal_last_seen, NAME)?,
    })
}

fn pose(x_m: f64, y_m: f64, yaw_rad: f64) -> Result<PlanarPose, Malformed> {
    Ok(PlanarPose {
        x_m: finite(x_m, "x_m", NAME)?,
        y_m: finite(y_m, "y_m", NAME)?,
        yaw_rad: finite(yaw_rad, "yaw_rad", NAME)?,
    })
}
