//! A noisy robot: what it believes, what it does, what it sees.

#![expect(clippy::unwrap_used, reason = "a test may fail by panicking")]

use core::time::Duration;
use std::sync::{Arc, LazyLock};

use homing_core::{Motion, Observation, PlanarPose, Resettable, RobotBridge, wrap_angle};
use homing_sim::arena::{Arena, BodySize, SceneRef};
use homing_sim::constants::{FORWARD_M, TURN_RAD};
use homing_sim::episode::{self, Episode, EpisodeSpec};
use homing_sim::flat::Detail;
use homing_sim::noise::{ActuationNoise, CameraNoise, DepthNoise, NoiseConfig, NoisePreset, PoseNoise};
use homing_sim::simulator::{SimConfig, Simulator};

const FORWARD: Motion = Motion::Forward { distance_m: FORWARD_M };
const LEFT: Motion = Motion::Turn { angle_rad: TURN_RAD };
const RIGHT: Motion = Motion::Turn { angle_rad: -TURN_RAD };
const HOLD: Motion = Motion::Stop { done: false };

static WORLD: LazyLock<(Arc<Arena>, Episode)> = LazyLock::new(|| {
    let arena = Arena::load_as(&SceneRef::Flat { seed: 5 }, BodySize::default(), Detail::Shape).unwrap();
    let episode = episode::draw(&arena, 5, &EpisodeSpec::default()).unwrap();
    (Arc::new(arena), episode)
});

fn robot(noise: NoiseConfig) -> Simulator {
    let mut config = SimConfig { noise, ..SimConfig::default() };
    (config.camera.width, config.camera.height) = (160, 120);
    let mut robot = Simulator::new(Arc::clone(&WORLD.0), config).unwrap();
    robot.reset(&WORLD.1).unwrap();
    robot
}

fn pose_noise(pose: PoseNoise) -> NoiseConfig {
    NoiseConfig { pose, ..NoiseConfig::default() }
}

/// Turns when something is in the way: 60 motions.
fn wander(robot: &mut Simulator) -> Vec<PlanarPose> {
    let mut moved = Vec::new();
    let mut turns = 0;
    for k in 0..60 {
        let motion = if turns > 0 {
            LEFT
        } else if k % 11 == 10 {
            RIGHT
        } else {
            FORWARD
        };
        let outcome = robot.apply(motion).unwrap();
        turns = if outcome.blocked { 5 } else { turns.max(1) - 1 };
        moved.push(outcome.moved);
    }
    moved
}

/// How far belief is from truth, metres and radians.
fn drift(robot: &Simulator) -> (f64, f64) {
    let (believed, truth) = (robot.odometry().t_odom_base.planar(), robot.t_odom_base_truth().planar());
    (believed.distance_to(truth.x_m, truth.y_m), wrap_angle(believed.yaw_rad - truth.yaw_rad).abs())
}

fn bits(robot: &Simulator) -> [u64; 6] {
    let (a, b) = (robot.odometry().t_odom_base.planar(), robot.pose_truth());
    [a.x_m, a.y_m, a.yaw_rad, b.x_m, b.y_m, b.yaw_rad].map(f64::to_bits)
}

#[test]
fn without_noise_belief_is_truth_to_the_bit() {
    let (mut plain, mut seeded) =
        (robot(NoiseConfig::default()), robot(NoiseConfig { seed: 99, ..NoiseConfig::default() }));
    assert_eq!(wander(&mut plain), wander(&mut seeded));
    assert_eq!(plain.odometry().t_odom_base, plain.t_odom_base_truth());
    assert_eq!(plain.observe().unwrap(), seeded.observe().unwrap());
}

#[test]
fn noisy_odometry_drifts_and_leaves_the_truth_alone() {
    let (mut exact, mut noisy) = (robot(NoiseConfig::default()), robot(pose_noise(PoseNoise::Ans)));
    let (_, moved) = (wander(&mut exact), wander(&mut noisy));
    assert_eq!(exact.pose_truth(), noisy.pose_truth());
    let (metres, radians) = drift(&noisy);
    // Some 15 turns of 2 to 3 cm each, not all in one direction, and 0.3 degrees a turn.
    assert!((0.03..2.0).contains(&metres) && (1e-4..0.3).contains(&radians), "{metres} m, {radians} rad");
    // What motions say they came to is what the odometry adds up to.
    let sum = moved.iter().fold(PlanarPose::default(), |at, by| {
        let (sin, cos) = at.yaw_rad.sin_cos();
        PlanarPose {
            x_m: at.x_m + cos * by.x_m - sin * by.y_m,
            y_m: at.y_m + sin * by.x_m + cos * by.y_m,
            yaw_rad: at.yaw_rad + by.yaw_rad,
        }
    });
    let believed = noisy.odometry().t_odom_base.planar();
    assert!(believed.distance_to(sum.x_m, sum.y_m) < 1e-9 && wrap_angle(believed.yaw_rad - sum.yaw_rad).abs() < 1e-9);
}

#[test]
fn the_published_pose_noise_does_not_drift() {
    let mut noisy = robot(pose_noise(PoseNoise::NrnsPublished));
    wander(&mut noisy);
    let (metres, radians) = drift(&noisy);
    assert!((1e-6..0.035).contains(&metres) && radians < 1e-9, "{metres} m, {radians} rad");
}

#[test]
fn an_episode_has_the_same_noise_whenever_it_is_played() {
    let play = |noise: NoiseConfig| {
        let mut robot = robot(noise);
        wander(&mut robot);
        let first = (bits(&robot), robot.observe().unwrap());
        robot.reset(&WORLD.1).unwrap();
        wander(&mut robot);
        assert!(first == (bits(&robot), robot.observe().unwrap()), "after a reset it is another one");
        first
    };
    let all = NoisePreset::All.config();
    let first = play(all);
    assert!(first == play(all), "another robot has other noise");
    let other = play(NoiseConfig { seed: 1, ..all });
    assert_ne!(first.0, other.0);
    assert_ne!(first.1.frame.rgb, other.1.frame.rgb);
}

#[test]
fn slipping_wheels_move_the_robot_and_exact_odometry_knows() {
    let mut slipping = robot(NoiseConfig { actuation: ActuationNoise::Ans, ..NoiseConfig::default() });
    let outcome = slipping.apply(LEFT).unwrap();
    assert!((0.262..0.35).contains(&outcome.moved.yaw_rad), "15 degrees become {}", outcome.moved.yaw_rad.to_degrees());
    assert!(outcome.moved.y_m > 0.01 && !outcome.blocked, "it slips to its left: {outcome:?}");
    assert_eq!(slipping.odometry().t_odom_base, slipping.t_odom_base_truth());
    assert_eq!(slipping.path_length_m_truth(), 0.0, "turning is no way");
    let mut raw = robot(NoiseConfig { actuation: ActuationNoise::AnsRaw, ..NoiseConfig::default() });
    let turned = raw.apply(LEFT).unwrap().moved.yaw_rad.to_degrees();
    assert!((9.5..13.5).contains(&turned), "as published 15 degrees are about 11: {turned}");
}

#[test]
fn a_blocked_step_came_to_what_really_happened_and_its_noise() {
    let mut noisy = robot(pose_noise(PoseNoise::Ans));
    let blocked = (0..100).find_map(|_| Some(noisy.apply(FORWARD).unwrap()).filter(|o| o.blocked));
    assert!(blocked.is_some(), "a hundred steps and no wall");
    let again = noisy.apply(FORWARD).unwrap();
    // The noise of one step has deviations below 3 mm.
    assert!(again.blocked && again.moved.distance_to(0.0, 0.0) < 0.02, "{again:?}");
    assert_ne!((again.moved.x_m, again.moved.y_m), (0.0, 0.0), "even a step that is blocked has noise");
}

#[test]
fn driving_by_velocities_drifts_and_standing_does_not() {
    let mut noisy = robot(NoisePreset::All.config());
    for _ in 0..200 {
        noisy.step_velocity(0.1, 0.5, Duration::from_millis(20)).unwrap();
    }
    let driven = drift(&noisy);
    assert!(driven.0 > 1e-3 && driven.1 > 1e-4, "{driven:?}");
    let before = bits(&noisy);
    for _ in 0..20 {
        noisy.step_velocity(0.0, 0.0, Duration::from_millis(20)).unwrap();
        noisy.apply(HOLD).unwrap();
        noisy.apply(Motion::Turn { angle_rad: 0.0 }).unwrap();
    }
    assert_eq!(bits(&noisy), before);
    noisy.step_velocity(0.3, 0.3, Duration::ZERO).unwrap();
    assert_eq!(bits(&noisy), before, "no time, no motion");
}

#[test]
fn noisy_depth_ends_at_ten_metres_and_is_of_the_moment() {
    let depth = Some(DepthNoise { multiplier: 1.0, range_min_m: 1.5 });
    let mut noisy = robot(NoiseConfig { depth, ..NoiseConfig::default() });
    let mut exact = robot(NoiseConfig::default());
    let (seen, clean) = (noisy.observe().unwrap(), exact.observe().unwrap());
    assert_eq!(seen.frame.rgb, clean.frame.rgb);
    assert!(seen.frame.depth.data().iter().all(|d| *d == 0.0 || (1.4..10.1).contains(d)));
    let share = |o: &Observation| o.frame.depth.valid_share();
    assert!(share(&seen) < share(&clean) && share(&seen) > 0.1, "{} of {}", share(&seen), share(&clean));
    assert_eq!(noisy.observe().unwrap(), seen);
    noisy.apply(HOLD).unwrap();
    assert_ne!(noisy.observe().unwrap().frame.depth, seen.frame.depth, "the next moment has other noise");
}

#[test]
fn a_turn_smears_the_image_and_standing_does_not() {
    let camera = Some(CameraNoise { exposure_s: 0.05, ..CameraNoise::NONE });
    let (mut blurred, mut exact) =
        (robot(NoiseConfig { camera, ..NoiseConfig::default() }), robot(NoiseConfig::default()));
    assert_eq!(blurred.observe().unwrap().frame.rgb, exact.observe().unwrap().frame.rgb);
    let mut turn = |motion| {
        exact.apply(motion).unwrap();
        blurred.apply(motion).unwrap();
        let of = |o: Observation| {
            let data = o.frame.rgb.data().to_vec();
            data.windows(4).map(|w| (f64::from(w[3]) - f64::from(w[0])).powi(2)).sum::<f64>()
        };
        (of(exact.observe().unwrap()), of(blurred.observe().unwrap()))
    };
    let (sharp, smeared) = turn(LEFT);
    assert!(smeared < 0.9 * sharp, "differences along rows: {smeared} of {sharp}");
    let (sharp, still) = turn(HOLD);
    assert_eq!(sharp, still);
}
