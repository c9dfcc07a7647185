//! A follower of shortest paths that knows everything: the yardstick for episodes and for what discovery can reach.

use homing_core::Motion;

use crate::body::Body;
use crate::constants::{FORWARD_M, TURN_RAD};
use crate::geodesic::GeodesicField;
use crate::nav_grid::NavGrid;

/// Most turns to either side.
const TURNS_MAX: i32 = 12;

/// The next discrete action towards the field's goal: of all headings in steps of a turn, the one from which a step
/// forward ends nearest to the goal. `None` once no step ends nearer.
#[must_use]
pub fn next_motion(body: &Body, grid: &NavGrid, field: &GeodesicField) -> Option<Motion> {
    let here_m = field.distance_m(body.pose.x_m, body.pose.y_m)?;
    let after = |turns: i32| {
        let mut trial = *body;
        trial.turn(f64::from(turns) * TURN_RAD);
        let travel = trial.advance(grid, FORWARD_M);
        let metres = field.distance_m(trial.pose.x_m, trial.pose.y_m).unwrap_or(f64::INFINITY);
        // A blocked step is no step; of equal ones, the one with the fewest turns wins.
        if travel.blocked { f64::INFINITY } else { metres + 1e-3 * f64::from(turns.abs()) }
    };
    let turns = (-TURNS_MAX..=TURNS_MAX).min_by(|a, b| after(*a).total_cmp(&after(*b)))?;
    if after(turns) >= here_m {
        return None;
    }
    Some(match turns {
        0 => Motion::Forward { distance_m: FORWARD_M },
        left if left > 0 => Motion::Turn { angle_rad: TURN_RAD },
        _ => Motion::Turn { angle_rad: -TURN_RAD },
    })
}
