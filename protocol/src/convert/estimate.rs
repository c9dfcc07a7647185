//! Goal estimates <-> homing_msgs/GoalEstimate.

use core::time::Duration;

use homing_core::{Camera, Frame, GoalEstimate, MatchedPoint, Sighting, StageTimes, Transform, UnseenReason};
use nalgebra::{Isometry3, Matrix6};

use super::{Malformed, ToDomain, ToMessage, finite, header, isometry, pose_message, stamp};
use crate::interfaces::homing_msgs;

const NAME: &str = "homing_msgs/GoalEstimate";
const NOT_SEEN: u8 = 0;
const BEARING: u8 = 1;
const POSE: u8 = 2;
const REASONS: [UnseenReason; 4] =
    [UnseenReason::TooFewMatches, UnseenReason::NoConsensus, UnseenReason::NoTexture, UnseenReason::NoGoal];

impl ToMessage<homing_msgs::GoalEstimate> for GoalEstimate {
    fn to_message(&self) -> homing_msgs::GoalEstimate {
        let nanoseconds = |d: Duration| u64::try_from(d.as_nanos()).unwrap_or(u64::MAX);
        let count = |n: usize| u32::try_from(n).unwrap_or(u32::MAX);
        let mut message = homing_msgs::GoalEstimate {
            header: header(self.stamp, Camera::NAME),
            goal_id: self.goal_id,
            pose: pose_message(&Isometry3::identity()),
            switch_probability: self.switch_probability.unwrap_or(f32::NAN),
            n_matches: count(self.n_matches),
            query_px: self.matched_points.iter().flat_map(|m| [m.query_px.0, m.query_px.1]).collect(),
            goal_px: self.matched_points.iter().flat_map(|m| [m.goal_px.0, m.goal_px.1]).collect(),
            extract_ns: nanoseconds(self.times.extract),
            matching_ns: nanoseconds(self.times.matching),
            pose_ns: nanoseconds(self.times.pose),
            kind: NOT_SEEN,
            reason: 0,
            covariance: [0.0; 21],
            bearing_rad: 0.0,
            bearing_sd_rad: 0.0,
            heading_rad: 0.0,
            rms_rad: 0.0,
            n_inliers: 0,
        };
        match &self.sighting {
            Sighting::NotSeen { reason } => {
                message.reason = REASONS.iter().position(|r| r == reason).unwrap_or_default() as u8;
            }
            Sighting::Bearing { bearing_rad, bearing_sd_rad, heading_rad, n_inliers } => {
                message.kind = BEARING;
                message.bearing_rad = *bearing_rad;
                message.bearing_sd_rad = *bearing_sd_rad;
                message.heading_rad = *heading_rad;
                message.n_inliers = count(*n_inliers);
            }
            Sighting::Pose { t_camera_goal, covariance, n_inliers, rms_rad } => {
                message.kind = POSE;
                message.pose = pose_message(t_camera_goal.isometry());
                for (value, (row, column)) in message.covariance.iter_mut().zip(upper_triangle()) {
                    *value = covariance[(row, column)];
                }
                message.n_inliers = count(*n_inliers);
                message.rms_rad = *rms_rad;
            }
        }
        message
    }
}

impl ToDomain<GoalEstimate> for homing_msgs::GoalEstimate {
    fn to_domain(&self) -> Result<GoalEstimate, Malformed> {
        if self.query_px.len() != self.goal_px.len() || !self.query_px.len().is_multiple_of(2) {
            return Err(Malformed::new(
                NAME,
                format!("{} query and {} goal coordinates", self.query_px.len(), self.goal_px.len()),
            ));
        }
        if self.query_px.iter().chain(&self.goal_px).any(|c| !c.is_finite()) {
            return Err(Malformed::new(NAME, "a matched point is not finite"));
        }
        let pairs = self.query_px.as_chunks::<2>().0.iter().zip(self.goal_px.as_chunks::<2>().0);
        Ok(GoalEstimate {
            stamp: stamp(&self.header.stamp, NAME)?,
            goal_id: self.goal_id,
            sighting: sighting(self)?,
            switch_probability: probability(self.switch_probability)?,
            n_matches: self.n_matches as usize,
            matched_points: pairs
                .map(|(q, g)| MatchedPoint { query_px: (q[0], q[1]), goal_px: (g[0], g[1]) })
                .collect(),
            times: StageTimes {
                extract: Duration::from_nanos(self.extract_ns),
                matching: Duration::from_nanos(self.matching_ns),
                pose: Duration::from_nanos(self.pose_ns),
            },
        })
    }
}

/// Places of the 21 numbers that make a symmetric 6x6 matrix.
fn upper_triangle() -> impl Iterator<Item = (usize, usize)> {
    (0..6).flat_map(|row| (row..6).map(move |column| (row, column)))
}

/// A number that is finite and not negative.
fn size(value: f64, field: &str) -> Result<f64, Malformed> {
    if finite(value, field, NAME)? < 0.0 {
        return Err(Malformed::new(NAME, format!("{field} is {value}: it cannot be negative")));
    }
    Ok(value)
}

/// A probability, NaN for none.
fn probability(value: f32) -> Result<Option<f32>, Malformed> {
    match value {
        none if none.is_nan() => Ok(None),
        some if (0.0..=1.0).contains(&some) => Ok(Some(some)),
        other => Err(Malformed::new(NAME, format!("switch_probability is {other}: it must lie in 0 to 1"))),
    }
}

fn sighting(message: &homing_msgs::GoalEstimate) -> Result<Sighting, Malformed> {
    let n_inliers = message.n_inliers as usize;
    match message.kind {
        NOT_SEEN => match REASONS.get(usize::from(message.reason)) {
            Some(reason) => Ok(Sighting::NotSeen { reason: *reason }),
            None => Err(Malformed::new(NAME, format!("reason {} does not exist", message.reason))),
        },
        BEARING => Ok(Sighting::Bearing {
            bearing_rad: finite(message.bearing_rad, "bearing_rad", NAME)?,
            bearing_sd_rad: size(message.bearing_sd_rad, "bearing_sd_rad")?,
            heading_rad: finite(message.heading_rad, "heading_rad", NAME)?,
            n_inliers,
        }),
        POSE => {
            let (p, q) = (&message.pose.position, &message.pose.orientation);
            let t_camera_goal = Transform::new(isometry([p.x, p.y, p.z], [q.x, q.y, q.z, q.w], NAME)?);
            let mut covariance = Matrix6::zeros();
            for (value, (row, column)) in message.covariance.iter().zip(upper_triangle()) {
                covariance[(row, column)] = *value;
                covariance[(column, row)] = *value;
            }
            if covariance.iter().any(|v| !v.is_finite()) || covariance.diagonal().iter().any(|v| *v < 0.0) {
                return Err(Malformed::new(NAME, "covariance is not finite, or negative on its diagonal"));
            }
            let rms_rad = size(message.rms_rad, "rms_rad")?;
            Ok(Sighting::Pose { t_camera_goal, covariance, n_inliers, rms_rad })
        }
        other => Err(Malformed::new(NAME, format!("kind {other} does not exist"))),
    }
}
