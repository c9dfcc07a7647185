//! Whole episodes in a small simulated world.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic, reason = "tests")]

mod world;

use homing_core::{Action, GoalDiscovery};
use homing_planner::discovery::{Frontier, Straight};
use homing_planner::{Planner, PlannerConfig};
use world::{Outcome, USUAL, World, run};

fn episode(seed: u64, discovery: Box<dyn GoalDiscovery>) -> Outcome {
    let mut world = World::flat(seed, (3.0, 10.0), USUAL);
    let mut planner = Planner::new(PlannerConfig::default(), discovery).unwrap();
    run(&mut world, &mut planner, |_, _| {})
}

fn median(mut values: Vec<f64>) -> f64 {
    values.sort_by(f64::total_cmp);
    values[values.len() / 2]
}

fn episodes(seeds: core::ops::Range<u64>, discovery: fn() -> Box<dyn GoalDiscovery>) -> Vec<Outcome> {
    let seeds: Vec<u64> = seeds.collect();
    std::thread::scope(|scope| {
        let halves: Vec<_> = seeds
            .chunks(seeds.len().div_ceil(2))
            .map(|half| scope.spawn(move || half.iter().map(|&seed| episode(seed, discovery())).collect::<Vec<_>>()))
            .collect();
        halves.into_iter().flat_map(|half| half.join().unwrap()).collect()
    })
}

#[test]
fn frontier_finds_the_goal_on_a_shorter_way_than_straight() {
    compare(20);
}

#[test]
#[ignore = "a minute of computing: the same on more layouts"]
fn frontier_finds_the_goal_in_more_layouts() {
    compare(100);
}

fn compare(n: u64) {
    let frontier = episodes(0..n, || Box::new(Frontier::default()));
    for (seed, o) in frontier.iter().enumerate() {
        println!(
            "{seed:3} {} steps {:3} path {:5.1} of {:4.1} m, final {:.2} m {:4.1} deg, {:.1} ms a step: {}",
            if o.success { "ok  " } else { "FAIL" },
            o.steps,
            o.path_m,
            o.shortest_m,
            o.final_m,
            o.final_rad.to_degrees(),
            o.total_ms / o.steps as f64,
            o.reason
        );
    }
    let straight = episodes(0..n / 3, || Box::new(Straight::new()));
    let rate = |all: &[Outcome]| all.iter().filter(|o| o.success).count() as f64 / all.len() as f64;
    let spl = |all: &[Outcome]| all.iter().map(Outcome::spl).sum::<f64>() / all.len() as f64;
    let of = |value: fn(&Outcome) -> f64| median(frontier.iter().filter(|o| o.success).map(value).collect());
    let (best, plain) = (rate(&frontier), rate(&straight));
    println!("frontier {best:.3} spl {:.3}; straight {plain:.3} spl {:.3}", spl(&frontier), spl(&straight));
    println!("final: {:.3} m, {:.2} deg", of(|o| o.final_m), of(|o| o.final_rad).to_degrees());
    assert!(best >= 0.9);
    assert!(spl(&straight) < 0.75 * spl(&frontier));
    assert!(of(|o| o.final_m) <= 0.15);
    assert!(of(|o| o.final_rad).to_degrees() <= 5.0);
}

#[test]
fn the_same_events_give_the_same_actions() {
    let (a, b) = (episode(3, Box::new(Frontier::default())), episode(3, Box::new(Frontier::default())));
    assert_eq!(a.actions, b.actions);
}

#[test]
fn it_does_not_swing_left_and_right() {
    for seed in 0..6 {
        let actions = episode(seed, Box::new(Frontier::default())).actions;
        let swings = actions
            .windows(4)
            .filter(|w| {
                use Action::{TurnLeft as L, TurnRight as R};
                matches!(w, [L, R, L, R] | [R, L, R, L])
            })
            .count();
        assert!(swings <= 2, "seed {seed}: {swings} swings in {} actions", actions.len());
    }
}
