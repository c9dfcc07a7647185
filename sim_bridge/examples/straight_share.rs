//! How hard the benchmark is: the share of its episodes that SLING's Straight policy solves with a perfect last mile.
//!
//! Straight drives forward and turns right once whenever it came less than 0.10 m (SLING, `navigate.py`). As soon as the
//! goal is within 4 m and in line of sight, an oracle takes over and follows the shortest path to it, which no perception
//! can better. `straight_share FIRST LAST`, seeds 1000 to 1099 unless given, one flat each.

use std::sync::Arc;

use homing_core::{Motion, Resettable, RobotBridge};
use homing_sim::arena::{Arena, BodySize, SceneRef};
use homing_sim::constants::{FORWARD_M, STEPS_MAX, TURN_RAD};
use homing_sim::episode::{self, Episode, EpisodeSpec, in_sight};
use homing_sim::flat::Detail;
use homing_sim::follower::next_motion;
use homing_sim::geodesic::GeodesicField;
use homing_sim::score::Score;
use homing_sim::simulator::{SimConfig, Simulator};
use rayon::prelude::*;

/// Straight turns after a step shorter than this, metres.
const STUCK_M: f64 = 0.10;
/// The switch to the last mile, metres (SLING's d_th).
const SWITCH_M: f64 = 4.0;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let numbers: Vec<u64> = std::env::args().skip(1).filter_map(|a| a.parse().ok()).collect();
    let (first, last) = (numbers.first().copied().unwrap_or(1000), numbers.get(1).copied().unwrap_or(1099));
    let scores: Vec<Score> = (first..=last).into_par_iter().filter_map(|seed| run(seed).ok()).collect();
    let n = scores.len() as f64;
    let successes = scores.iter().filter(|s| s.success).count();
    let spl: f64 = scores.iter().map(|s| s.spl).sum::<f64>() / n;
    let way: f64 = scores.iter().map(|s| s.shortest_path_m).sum::<f64>() / n;
    println!("{} of {} episodes drawn; mean shortest path {way:.2} m", scores.len(), last + 1 - first);
    println!("Straight with an oracle's last mile: success {:.1} %, SPL {spl:.3}", 100.0 * successes as f64 / n);
    Ok(())
}

fn run(seed: u64) -> Result<Score, Box<dyn std::error::Error>> {
    let arena = Arc::new(Arena::load_as(&SceneRef::Flat { seed }, BodySize::default(), Detail::Shape)?);
    let episode = episode::draw(&arena, seed, &EpisodeSpec::default())?;
    let mut robot = Simulator::new(arena.clone(), SimConfig::default())?;
    robot.reset(&episode)?;
    let field = GeodesicField::to(arena.space(), (episode.goal.x_m, episode.goal.y_m))?;
    let mut last_m = f64::INFINITY;
    let mut exploit = false;
    while robot.steps() + 1 < STEPS_MAX {
        exploit = exploit || sees_goal(&robot, &episode);
        let Some(motion) =
            (if exploit { next_motion(robot.body_truth(), arena.grid(), &field) } else { Some(straight(last_m)) })
        else {
            break;
        };
        let outcome = robot.apply(motion)?;
        last_m = match motion {
            Motion::Forward { .. } => libm::hypot(outcome.moved.x_m, outcome.moved.y_m),
            _ => f64::INFINITY,
        };
    }
    if exploit {
        robot.apply(Motion::Stop { done: true })?;
    }
    Ok(robot.score_truth(&episode))
}

fn straight(last_m: f64) -> Motion {
    if last_m < STUCK_M { Motion::Turn { angle_rad: -TURN_RAD } } else { Motion::Forward { distance_m: FORWARD_M } }
}

fn sees_goal(robot: &Simulator, episode: &Episode) -> bool {
    let pose = robot.pose_truth();
    let goal = (episode.goal.x_m, episode.goal.y_m);
    pose.distance_to(goal.0, goal.1) <= SWITCH_M && in_sight(robot.arena(), (pose.x_m, pose.y_m), goal)
}
