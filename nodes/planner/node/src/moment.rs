//! Collects what belongs to one moment: depth, intrinsics and odometry of one stamp, and perception's answer to it.

use std::collections::{BTreeMap, BTreeSet};
use std::sync::Arc;

use homing_core::{
    Base, Camera, DepthImage, GoalEstimate, Intrinsics, Odometry, Sighting, Stamp, Transform, UnseenReason,
};
use homing_planner::PlannerObservation;

/// Moments kept while their parts are still arriving.
const WAITING_MAX: usize = 16;
/// Odometry kept: five seconds at 50 Hz.
const ODOMETRY_MAX: usize = 256;
/// Answers remembered as taken.
const TAKEN_MAX: usize = 64;

/// What has arrived and was not yet used.
#[derive(Default)]
pub struct Moments {
    waiting: BTreeMap<Stamp, Parts>,
    mount: Option<Transform<Base, Camera>>,
    estimates: BTreeMap<Stamp, GoalEstimate>,
    /// Stamps whose answers were taken: a frame sent again on a busy machine is answered again, and counts once.
    taken: BTreeSet<Stamp>,
    // More frequent than images: kept apart, so that it does not push them out.
    odometry: BTreeMap<Stamp, Odometry>,
    clock: Stamp,
}

#[derive(Default)]
struct Parts {
    depth: Option<Arc<DepthImage>>,
    intrinsics: Option<Intrinsics>,
}

impl Moments {
    pub fn depth(&mut self, stamp: Stamp, depth: DepthImage) {
        self.parts(stamp).depth = Some(Arc::new(depth));
    }

    pub fn intrinsics(&mut self, stamp: Stamp, intrinsics: Intrinsics) {
        self.parts(stamp).intrinsics = Some(intrinsics);
    }

    /// Keeps a reading; says whether the robot's clock began anew, which makes all that was kept worthless.
    pub fn odometry(&mut self, odometry: Odometry) -> bool {
        let began_anew = odometry.stamp.began_anew_after(self.clock);
        if began_anew {
            self.clear();
        }
        self.clock = odometry.stamp;
        self.odometry.insert(odometry.stamp, odometry);
        while self.odometry.len() > ODOMETRY_MAX {
            self.odometry.pop_first();
        }
        began_anew
    }

    pub fn mount(&mut self, t_base_camera: Transform<Base, Camera>) {
        self.mount = Some(t_base_camera);
    }

    /// Keeps an estimate that speaks of `goal_id`, and says whether it does. "No goal yet" is no answer: the photo is still
    /// on its way; nor is what was answered before.
    pub fn estimate(&mut self, estimate: GoalEstimate, goal_id: u64) -> bool {
        let no_goal = matches!(estimate.sighting, Sighting::NotSeen { reason: UnseenReason::NoGoal });
        if no_goal || estimate.goal_id != goal_id || self.taken.contains(&estimate.stamp) {
            return false;
        }
        self.estimates.insert(estimate.stamp, estimate);
        while self.estimates.len() > WAITING_MAX {
            self.estimates.pop_first();
        }
        true
    }

    /// The robot's clock, as of its last odometry.
    pub fn clock(&self) -> Stamp {
        self.clock
    }

    /// The newest complete moment at or after `from`.
    pub fn newest(&self, from: Stamp) -> Option<PlannerObservation> {
        self.complete(from).next()
    }

    /// The newest complete moment at or after `from` that perception has answered.
    pub fn newest_answered(&self, from: Stamp) -> Option<PlannerObservation> {
        self.complete(from).find(|o| self.estimates.contains_key(&o.odometry.stamp))
    }

    /// Complete moments, newest first.
    fn complete(&self, from: Stamp) -> impl Iterator<Item = PlannerObservation> + '_ {
        self.waiting.range(from..).rev().filter_map(|(stamp, parts)| {
            Some(PlannerObservation {
                odometry: *self.odometry.get(stamp)?,
                depth: Arc::clone(parts.depth.as_ref()?),
                intrinsics: parts.intrinsics?,
                t_base_camera: self.mount?,
            })
        })
    }

    /// Takes the answers up to `stamp`, oldest first; forgets everything before the moment at `stamp`.
    pub fn close(&mut self, stamp: Stamp) -> Vec<GoalEstimate> {
        let later = self.estimates.split_off(&Stamp(stamp.0.saturating_add(1)));
        self.waiting.retain(|at, _| *at > stamp);
        let answers = std::mem::replace(&mut self.estimates, later);
        self.taken.extend(answers.keys());
        while self.taken.len() > TAKEN_MAX {
            self.taken.pop_first();
        }
        answers.into_values().collect()
    }

    /// Forgets all moments: the robot's clock began anew, or the goal changed.
    pub fn clear(&mut self) {
        self.waiting.clear();
        self.estimates.clear();
        self.taken.clear();
        self.odometry.clear();
    }

    fn parts(&mut self, stamp: Stamp) -> &mut Parts {
        while self.waiting.len() >= WAITING_MAX && !self.waiting.contains_key(&stamp) {
            self.waiting.pop_first();
        }
        self.waiting.entry(stamp).or_default()
    }
}

#[cfg(test)]
mod tests {
    use homing_core::StageTimes;

    use super::*;

    fn answer(stamp: u64, goal_id: u64) -> GoalEstimate {
        GoalEstimate {
            stamp: Stamp(stamp),
            goal_id,
            sighting: Sighting::NotSeen { reason: UnseenReason::NoConsensus },
            switch_probability: None,
            n_matches: 0,
            matched_points: Vec::new(),
            times: StageTimes::default(),
        }
    }

    #[test]
    fn an_answer_that_comes_twice_counts_once() {
        let mut moments = Moments::default();
        assert!(moments.estimate(answer(5, 1), 1) && moments.estimate(answer(5, 1), 1));
        assert_eq!(moments.close(Stamp(5)), [answer(5, 1)]);
        assert!(!moments.estimate(answer(5, 1), 1), "it was taken");
        // What memory says of an image from before is new.
        assert!(moments.estimate(answer(3, 1), 1) && moments.estimate(answer(6, 1), 1));
        assert_eq!(moments.close(Stamp(6)), [answer(3, 1), answer(6, 1)]);
        moments.clear();
        assert!(moments.estimate(answer(5, 2), 2), "of another goal it says something else");
    }
}
