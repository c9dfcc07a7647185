//! How an episode went: the strict score.

use serde::{Deserialize, Serialize};

use crate::constants::{STEPS_MAX, SUCCESS_M};

/// What the scorer must know of an episode that is over. Ground truth.
#[derive(Copy, Clone, Debug, PartialEq)]
pub struct Finish {
    /// The robot declared the goal reached.
    pub stopped: bool,
    /// Actions taken, the stop included.
    pub steps: u64,
    /// Way really made, metres.
    pub path_length_m: f64,
    /// Geodesic distance from start to goal, metres.
    pub shortest_path_m: f64,
    /// Geodesic distance from the last position to the goal, metres; `None` if the goal cannot be reached from there.
    pub final_distance_m: Option<f64>,
    /// Heading of the robot relative to the goal's at the end, radians.
    pub final_heading_error_rad: f64,
}

/// The strict score: success is the robot's own stop within [`STEPS_MAX`] actions and [`SUCCESS_M`] geodesic metres of
/// the goal.
#[derive(Copy, Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Score {
    /// Stopped in time and near enough.
    pub success: bool,
    /// Actions taken, the stop included.
    pub steps: u64,
    /// Way really made, metres.
    pub path_length_m: f64,
    /// Geodesic distance from start to goal, metres.
    pub shortest_path_m: f64,
    /// Success weighted by path length (Anderson et al. 2018, arXiv 1807.06757): S l / max(p, l).
    pub spl: f64,
    /// Geodesic distance to the goal at the end, metres; the straight start distance if it is out of reach.
    pub final_distance_m: f64,
    /// Absolute difference of headings at the end, degrees.
    pub final_heading_error_deg: f64,
}

impl Score {
    /// Scores an episode.
    #[must_use]
    pub fn strict(finish: &Finish) -> Self {
        let distance = finish.final_distance_m;
        let success = finish.stopped && finish.steps <= STEPS_MAX && distance.is_some_and(|d| d <= SUCCESS_M);
        let longer = finish.path_length_m.max(finish.shortest_path_m);
        let efficiency = if longer > 0.0 { finish.shortest_path_m / longer } else { 1.0 };
        Self {
            success,
            steps: finish.steps,
            path_length_m: finish.path_length_m,
            shortest_path_m: finish.shortest_path_m,
            spl: if success { efficiency } else { 0.0 },
            final_distance_m: distance.unwrap_or(finish.shortest_path_m),
            final_heading_error_deg: homing_core::wrap_angle(finish.final_heading_error_rad).abs().to_degrees(),
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
        path_length_m: 8.0,
        shortest_path_m: 6.0,
        final_distance_m: Some(0.4),
        final_heading_error_rad: -0.1,
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
    fn the_keys_are_those_of_the_benchmark() {
        let json = serde_json::to_value(Score::strict(&GOOD)).unwrap();
        let keys: Vec<&String> = json.as_object().unwrap().keys().collect();
        let expected = [
            "final_distance_m",
            "final_heading_error_deg",
            "path_length_m",
            "shortest_path_m",
            "spl",
            "steps",
            "success",
        ];
        let mut sorted = keys.clone();
        sorted.sort();
        assert_eq!(sorted, expected);
    }
}
