//! Collects what belongs to one moment: depth, intrinsics and odometry of one stamp, and perception's answer to it.

use std::collections::BTreeMap;
use std::sync::Arc;

use homing_core::{
    Base, Camera, DepthImage, GoalEstimate, Intrinsics, Odometry, Sighting, Stamp, Transform, UnseenReason,
};
use homing_planner::PlannerObservation;

/// Moments kept while their parts are still arriving.
const WAITING_MAX: usize = 16;

/// What has arrived and was not yet used.
#[derive(Default)]
pub struct Moments {
    waiting: BTreeMap<Stamp, Parts>,
    mount: Option<Transform<Base, Camera>>,
    estimates: BTreeMap<Stamp, GoalEstimate>,
}

#[derive(Default)]
struct Parts {
    depth: Option<Arc<DepthImage>>,
    intrinsics: Option<Intrinsics>,
    odometry: Option<Odometry>,
}

impl Moments {
    pub fn depth(&mut self, stamp: Stamp, depth: DepthImage) {
        self.parts(stamp).depth = Some(Arc::new(depth));
    }

    pub fn intrinsics(&mut self, stamp: Stamp, intrinsics: Intrinsics) {
        self.parts(stamp).intrinsics = Some(intrinsics);
    }

    pub fn odometry(&mut self, odometry: Odometry) {
        self.parts(odometry.stamp).odometry = Some(odometry);
    }

    pub fn mount(&mut self, t_base_camera: Transform<Base, Camera>) {
        self.mount = Some(t_base_camera);
    }

    /// Keeps an estimate that speaks of `goal_id`. "No goal yet" is no answer: the photo is still on its way.
    pub fn estimate(&mut self, estimate: GoalEstimate, goal_id: u64) {
        let no_goal = matches!(estimate.sighting, Sighting::NotSeen { reason: UnseenReason::NoGoal });
        if no_goal || estimate.goal_id != goal_id {
            return;
        }
        self.estimates.insert(estimate.stamp, estimate);
        while self.estimates.len() > WAITING_MAX {
            self.estimates.pop_first();
        }
    }

    /// The newest complete moment at or after `from`.
    pub fn newest(&self, from: Stamp) -> Option<PlannerObservation> {
        let t_base_camera = self.mount?;
        self.waiting.range(from..).rev().find_map(|(_, parts)| {
            Some(PlannerObservation {
                odometry: parts.odometry?,
                depth: Arc::clone(parts.depth.as_ref()?),
                intrinsics: parts.intrinsics?,
                t_base_camera,
            })
        })
    }

    /// True if perception's answer to the moment at `stamp` is here.
    pub fn answered(&self, stamp: Stamp) -> bool {
        self.estimates.contains_key(&stamp)
    }

    /// Takes the newest answer up to `stamp`; forgets everything before the moment at `stamp`.
    pub fn close(&mut self, stamp: Stamp) -> Option<GoalEstimate> {
        let newest = self.estimates.range(..=stamp).next_back().map(|(at, _)| *at);
        let estimate = newest.and_then(|at| self.estimates.remove(&at));
        self.estimates.retain(|at, _| *at > stamp);
        self.waiting.retain(|at, _| *at > stamp);
        estimate
    }

    /// Forgets all moments: the robot's clock began anew, or the goal changed.
    pub fn clear(&mut self) {
        self.waiting.clear();
        self.estimates.clear();
    }

    fn parts(&mut self, stamp: Stamp) -> &mut Parts {
        while self.waiting.len() >= WAITING_MAX && !self.waiting.contains_key(&stamp) {
            self.waiting.pop_first();
        }
        self.waiting.entry(stamp).or_default()
    }
}
