//! How an episode went, by two scorers: the strict one, which we quote, and the loose one of the published tables.

use homing_core::{PlanarPose, wrap_angle};
use serde::{Deserialize, Serialize};

use crate::arena::Arena;
use crate::constants::STEPS_MAX;
use crate::episode::Episode;
use crate::geodesic::GeodesicField;

/// A robot that touches something stands at most this far from the nearest free cell, metres.
const BESIDE_M: f64 = 0.25;

/// How a robot ended. Ground truth.
#[derive(Copy, Clone, Debug, PartialEq)]
pub struct Ending {
    /// The robot declared the goal reached.
    pub stopped: bool,
    /// Actions taken, the stop included.
    pub steps: u64,
    /// Of these, driving to a goal that was found.
    pub last_mile_steps: u64,
    /// Way really made, metres.
    pub path_length_m: f64,
    /// Motions that an obstacle cut short.
    pub collisions: u64,
    /// Where it is, world frame.
    pub pose: PlanarPose,
}

/// What the scorers must know of an episode that is over. Ground truth.
#[derive(Copy, Clone, Debug, PartialEq)]
pub struct Finish {
    /// The robot declared the goal reached.
    pub stopped: bool,
    /// Actions taken, the stop included.
    pub steps: u64,
    /// Of these, driving to a goal that was found.
    pub last_mile_steps: u64,
    /// Way really made, metres.
    pub path_length_m: f64,
    /// Geodesic distance from start to goal, metres.
    pub shortest_path_m: f64,
    /// Geodesic distance from the last position to the goal, metres; `None` if the goal cannot be reached from there.
    pub final_distance_m: Option<f64>,
    /// Straight distance from the last position to the goal, walls or not, metres.
    pub final_straight_m: f64,
    /// Heading of the robot relative to the goal's at the end, radians.
    pub final_heading_error_rad: f64,
    /// Motions that an obstacle cut short.
    pub collisions: u64,
    /// How near is success, metres.
    pub success_m: f64,
}

impl Finish {
    /// Measures how a robot ended against its task: distances are to the nearest of its view points, or to the photo's
    /// place where it has none.
    #[must_use]
    pub fn new(arena: &Arena, episode: &Episode, ending: &Ending) -> Self {
        let (final_distance_m, final_straight_m) = distances_left(arena, episode, (ending.pose.x_m, ending.pose.y_m));
        Self {
            stopped: ending.stopped,
            steps: ending.steps,
            last_mile_steps: ending.last_mile_steps,
            path_length_m: ending.path_length_m,
            shortest_path_m: episode.shortest_path_m,
            final_distance_m,
            final_straight_m,
            final_heading_error_rad: ending.pose.yaw_rad - episode.goal.yaw_rad,
            collisions: ending.collisions,
            success_m: episode.success_m,
        }
    }
}

/// From a place to where the episode ends, metres: along the floor, if there is a way, and straight.
fn distances_left(arena: &Arena, episode: &Episode, at: (f64, f64)) -> (Option<f64>, f64) {
    let straight = |p: (f64, f64)| libm::hypot(p.0 - at.0, p.1 - at.1);
    let goal = (episode.goal.x_m, episode.goal.y_m);
    if episode.view_points.is_empty() {
        let field = GeodesicField::to(arena.space(), goal).ok();
        return (field.and_then(|f| f.distance_m(at.0, at.1)), straight(goal));
    }
    // Ways are as long there as back: one field from here serves all view points.
    let here = arena.space().nearest(at.0, at.1, BESIDE_M);
    let field = here.and_then(|p| GeodesicField::to(arena.space(), p).ok());
    let ways = field.iter().flat_map(|f| episode.view_points.iter().filter_map(|p| f.distance_m(p.0, p.1)));
    let nearest = episode.view_points.iter().map(|p| straight(*p)).fold(f64::MAX, f64::min);
    (ways.min_by(f64::total_cmp).map(|way| way.max(nearest)), nearest)
}

/// What a scorer says.
#[derive(Copy, Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Score {
    /// In time and near enough, by the scorer's rule.
    pub success: bool,
    /// Actions taken, the stop included.
    pub steps: u64,
    /// Way really made, metres.
    pub path_length_m: f64,
    /// Geodesic distance from start to goal, metres.
    pub shortest_path_m: f64,
    /// Success weighted by path length (Anderson et al. 2018, arXiv 1807.06757): S l / max(p, l).
    pub spl: f64,
    /// The same with max(0, 1 - d / l) for S, d the distance left (Datta et al. 2020).
    pub soft_spl: f64,
    /// Distance to the goal at the end, metres, by the scorer's measure; the straight one if there is no way.
    pub final_distance_m: f64,
    /// Absolute difference of headings at the end, degrees.
    pub final_heading_error_deg: f64,
    /// Motions that an obstacle cut short.
    pub collisions: u64,
}

impl Score {
    /// The strict score, Habitat's: success is the robot's own stop within [`STEPS_MAX`] actions and the episode's
    /// success distance of the goal along the floor.
    #[must_use]
    pub fn strict(finish: &Finish) -> Self {
        let distance = finish.final_distance_m;
        let success = finish.stopped && finish.steps <= STEPS_MAX && distance.is_some_and(|d| d <= finish.success_m);
        Self::new(finish, success, distance.unwrap_or(finish.final_straight_m))
    }

    /// The score as NRNS and SLING counted: success is to be within the success distance of the goal, walls or not,
    /// stopped or not, while fewer than [`STEPS_MAX`] actions went by, those of the last mile not counted.
    #[must_use]
    pub fn published(finish: &Finish) -> Self {
        let counted = finish.steps.saturating_sub(finish.last_mile_steps);
        let success = counted < STEPS_MAX && finish.final_straight_m <= finish.success_m;
        Self::new(finish, success, finish.final_straight_m)
    }

    fn new(finish: &Finish, success: bool, final_distance_m: f64) -> Self {
        let (way, shortest) = (finish.path_length_m, finish.shortest_path_m);
        let efficiency = if way.max(shortest) > 0.0 { shortest / way.max(shortest) } else { 1.0 };
        let progress = if shortest > 0.0 { (1.0 - final_distance_m / shortest).max(0.0) } else { f64::from(success) };
        Self {
            success,
            steps: finish.steps,
            path_length_m: way,
            shortest_path_m: shortest,
            spl: if success { efficiency } else { 0.0 },
            soft_spl: progress * efficiency,
            final_distance_m,
            final_heading_error_deg: wrap_angle(finish.final_heading_error_rad).abs().to_degrees(),
            collisions: finish.collisions,
        }
    }
}

#[cfg(test)]
#[expect(clippy::unwrap_used, reason = "a test may fail by panicking")]
mod tests {
    use super::*;

    const GOOD: Finish = Finish {
        stopped: true,
        steps: 80,
        last_mile_steps: 20,
        path_length_m: 8.0,
        shortest_path_m: 6.0,
        final_distance_m: Some(0.4),
        final_straight_m: 0.3,
        final_heading_error_rad: -0.1,
        collisions: 2,
        success_m: 1.0,
    };

    #[test]
    fn a_stop_near_the_goal_succeeds_and_a_detour_costs() {
        let score = Score::strict(&GOOD);
        assert!(score.success);
        assert!((score.spl - 0.75).abs() < 1e-12);
        assert!((score.final_heading_error_deg - 5.729_577_951).abs() < 1e-6);
        let short = Score::strict(&Finish { path_length_m: 5.6, ..GOOD });
        assert!((short.spl - 1.0).abs() < 1e-12, "ending before the goal is no better than the shortest path");
    }

    #[test]
    fn the_published_rule_is_loose() {
        let wins = |f: Finish| Score::published(&f).success;
        // Neither a stop nor a way to the goal is asked for, and the last mile is free.
        assert!(wins(Finish { stopped: false, final_distance_m: Some(7.0), ..GOOD }));
        assert!(wins(Finish { final_distance_m: None, ..GOOD }));
        assert!(wins(Finish { steps: 519, ..GOOD }));
        assert!(!wins(Finish { steps: 520, ..GOOD }));
        assert!(!wins(Finish { final_straight_m: 1.000_1, final_distance_m: Some(1.000_1), ..GOOD }));
        let score = Score::published(&GOOD);
        assert!((score.spl - 0.75).abs() < 1e-12 && (score.final_distance_m - 0.3).abs() < 1e-12);
    }

    #[test]
    fn soft_spl_rewards_progress() {
        // Worked by hand: (1 - 1.5 / 6) * 6 / 8.
        let half = Finish { final_distance_m: Some(1.5), ..GOOD };
        let score = Score::strict(&half);
        assert!(!score.success && (score.soft_spl - 0.5625).abs() < 1e-12);
        assert_eq!(Score::strict(&Finish { final_distance_m: Some(9.0), ..GOOD }).soft_spl, 0.0);
    }

    #[test]
    fn standing_at_the_goal_without_stopping_fails() {
        let fails = |f: Finish| {
            let score = Score::strict(&f);
            assert!(!score.success && score.spl == 0.0, "{f:?}");
        };
        fails(Finish { stopped: false, ..GOOD });
        fails(Finish { steps: STEPS_MAX + 1, ..GOOD });
        fails(Finish { final_distance_m: Some(1.000_1), ..GOOD });
        fails(Finish { final_distance_m: None, ..GOOD });
        assert!(Score::strict(&Finish { steps: STEPS_MAX, final_distance_m: Some(1.0), ..GOOD }).success);
    }

    #[test]
    fn both_scorers_take_the_episode_s_own_success_distance() {
        let near = Finish { success_m: 0.1, final_distance_m: Some(0.12), final_straight_m: 0.12, ..GOOD };
        assert!(!Score::strict(&near).success && !Score::published(&near).success);
        let at = Finish { final_distance_m: Some(0.1), final_straight_m: 0.1, ..near };
        assert!(Score::strict(&at).success && Score::published(&at).success);
    }

    #[test]
    fn the_keys_are_those_of_the_benchmark() {
        let json = serde_json::to_value(Score::strict(&GOOD)).unwrap();
        let keys: Vec<&String> = json.as_object().unwrap().keys().collect();
        let expected = [
            "collisions",
            "final_distance_m",
            "final_heading_error_deg",
            "path_length_m",
            "shortest_path_m",
            "soft_spl",
            "spl",
            "steps",
            "success",
        ];
        let mut sorted = keys.clone();
        sorted.sort();
        assert_eq!(sorted, expected);
    }
}
