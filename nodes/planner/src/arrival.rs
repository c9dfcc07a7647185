//! The decision to stop: close enough that no step leads closer, turned to the photo's heading, and seen to be so. A turn
//! of 15 degrees leaves up to 7.5: what is left is turned at the end, once and finely.

use homing_core::{PlanarPose, Stamp, wrap_angle};

use crate::config::BodyConfig;
use crate::hypothesis::Hypothesis;
use crate::local::{LocalChoice, LocalPlanner};
use crate::terrain::Terrain;

/// When the goal is reached.
#[derive(Copy, Clone, Debug, PartialEq)]
pub struct ArrivalConfig {
    /// Within this distance the straight line counts instead of the map's cost, metres.
    pub near_m: f64,
    /// A step that shortens the distance by less is not worth it, metres.
    pub gain_m: f64,
    /// Once turning to the heading, only a step that shortens the distance by this much is taken, metres.
    pub regain_m: f64,
    /// Times the body may leave its final heading to come closer.
    pub returns_max: u32,
    /// A heading that is off by less needs no last turn, radians.
    pub fine_rad: f64,
    /// Last turns, each finer than a whole one.
    pub fine_turns_max: u32,
    /// Fresh estimates waited for at the goal before deciding without.
    pub wait_steps_max: u32,
}

impl Default for ArrivalConfig {
    fn default() -> Self {
        Self {
            near_m: 0.6,
            gain_m: 0.03,
            regain_m: 0.10,
            returns_max: 3,
            fine_rad: 0.01,
            fine_turns_max: 2,
            wait_steps_max: 8,
        }
    }
}

/// What the last metre asks for.
#[derive(Copy, Clone, Debug, PartialEq, Eq)]
pub enum Approach {
    /// Still on the way: follow the route.
    Drive,
    /// One more step.
    Step(LocalChoice),
    /// Position reached: turn to the heading.
    Align(LocalChoice),
    /// The heading is nearer than a whole turn: turn by what is left, milliradians, left positive.
    Face(i32),
    /// Position and heading reached, confirmed from here.
    Arrived,
    /// Position and heading reached, no estimate from here yet.
    Wait,
    /// Position and heading reached, and the photo's view is not there.
    Refuted,
}

/// Progress of the last metre.
#[derive(Clone, Debug, Default)]
pub struct Arrival {
    aligning: bool,
    n_returns: u32,
    n_fine_turns: u32,
    in_place_since: Option<Stamp>,
    n_waited: u32,
    confirmed: bool,
    n_denied: u32,
    heard: Option<(Stamp, bool)>,
}

impl Arrival {
    /// Begins anew: another goal, or the old one again.
    pub fn reset(&mut self) {
        *self = Self::default();
    }

    /// True while turning to the goal's heading.
    pub fn is_aligning(&self) -> bool {
        self.aligning
    }

    /// An estimate of the image stamped `stamp` came; `agreed` with the hypothesis or not. Only images taken in place count.
    pub fn hear(&mut self, stamp: Stamp, agreed: bool) {
        self.heard = Some((stamp, agreed));
        if self.in_place_since.is_some_and(|since| stamp >= since) {
            self.count(agreed);
        }
    }

    /// What to do at `pose` for `hypothesis`; `end_m` is where its route ends.
    pub fn approach(
        &mut self,
        config: &ArrivalConfig,
        stamp: Stamp,
        pose: &PlanarPose,
        hypothesis: &Hypothesis,
        end_m: (f64, f64),
        ground: (&LocalPlanner, &Terrain, &BodyConfig),
    ) -> Approach {
        let (local, terrain, body) = ground;
        let goal = &hypothesis.pose;
        let blocked_off = goal.distance_to(end_m.0, end_m.1) > body.forward_m;
        let aim = if blocked_off { end_m } else { (goal.x_m, goal.y_m) };
        if pose.distance_to(aim.0, aim.1) > config.near_m {
            self.leave();
            return Approach::Drive;
        }
        let gain_m = if self.aligning { config.regain_m } else { config.gain_m };
        let step = local.close_in(pose, aim, gain_m, terrain);
        if step != LocalChoice::Nowhere && self.n_returns < config.returns_max {
            self.n_returns += u32::from(self.aligning);
            self.leave();
            return Approach::Step(step);
        }
        self.aligning = true;
        let turn = local.face(pose, goal.yaw_rad);
        if turn != LocalChoice::Nowhere {
            self.in_place_since = None;
            return Approach::Align(turn);
        }
        let left_rad = wrap_angle(goal.yaw_rad - pose.yaw_rad);
        if left_rad.abs() > config.fine_rad && self.n_fine_turns < config.fine_turns_max {
            self.n_fine_turns += 1;
            self.in_place_since = None;
            return Approach::Face((1e3 * left_rad).round() as i32);
        }
        self.judge(config, stamp)
    }

    fn judge(&mut self, config: &ArrivalConfig, stamp: Stamp) -> Approach {
        if self.in_place_since.is_none() {
            self.in_place_since = Some(stamp);
            self.n_waited = 0;
            self.confirmed = false;
            self.n_denied = 0;
            // The estimate of this very image may have come with it.
            if let Some((_, agreed)) = self.heard.filter(|(heard, _)| *heard >= stamp) {
                self.count(agreed);
            }
        }
        self.n_waited += 1;
        if self.confirmed {
            Approach::Arrived
        } else if self.n_denied >= 3 || self.n_waited > config.wait_steps_max {
            Approach::Refuted
        } else {
            Approach::Wait
        }
    }

    fn count(&mut self, agreed: bool) {
        self.confirmed |= agreed;
        self.n_denied += u32::from(!agreed);
    }

    fn leave(&mut self) {
        self.aligning = false;
        self.in_place_since = None;
    }
}
