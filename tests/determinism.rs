//! The same seed and the same actions give the same observations, bit for bit, whatever the number of threads.
#![expect(clippy::unwrap_used, reason = "a test may fail by panicking")]

use std::sync::{Arc, LazyLock};
use std::time::Duration;

use homing_core::{Action, Motion, Observation, Resettable, RobotBridge};
use homing_sim::constants::{FORWARD_M, TURN_RAD};
use homing_sim::{Arena, BodySize, Episode, EpisodeSpec, SceneRef, SimConfig, Simulator, episode};

const SEED: u64 = 1003;

/// Everything a body said, as bits: two NaN or a zero of another sign would differ.
#[derive(Clone, PartialEq, Eq, Debug, Default)]
struct Bits(Vec<u64>);

impl Bits {
    fn number(&mut self, value: f64) {
        self.0.push(value.to_bits());
    }

    fn numbers(&mut self, values: impl IntoIterator<Item = f64>) {
        values.into_iter().for_each(|v| self.number(v));
    }

    fn see(&mut self, seen: &Observation) {
        self.0.push(seen.frame.stamp.0);
        self.0.extend(seen.frame.rgb.data().iter().map(|b| u64::from(*b)));
        self.0.extend(seen.frame.depth.data().iter().map(|d| u64::from(d.to_bits())));
        let t = seen.odometry.t_odom_base;
        self.numbers(t.translation().iter().chain(t.rotation().coords.iter()).copied());
        self.numbers([seen.odometry.linear_m_s, seen.odometry.angular_rad_s]);
        let scan = seen.scan.as_ref().unwrap();
        self.0.extend(scan.ranges_m.iter().map(|r| u64::from(r.to_bits())));
    }
}

fn actions() -> Vec<Motion> {
    use Action::{Forward, Hold, TurnLeft, TurnRight};
    let steps = [Forward, Forward, TurnLeft, Forward, TurnRight, TurnRight, Forward, Hold, Forward, TurnLeft, Forward];
    let mut motions: Vec<Motion> = steps.iter().map(|a| a.motion(FORWARD_M, TURN_RAD)).collect();
    motions.push(Motion::Velocity { linear_m_s: 0.31, angular_rad_s: -0.17 });
    motions.push(Motion::Forward { distance_m: -0.1 });
    motions
}

fn run(simulator: &mut Simulator) -> Bits {
    let mut bits = Bits::default();
    bits.see(&simulator.observe().unwrap());
    for motion in actions() {
        let outcome = simulator.apply(motion).unwrap();
        bits.numbers([outcome.moved.x_m, outcome.moved.y_m, outcome.moved.yaw_rad]);
        bits.0.extend([outcome.stamp.0, u64::from(outcome.blocked)]);
        bits.see(&simulator.observe().unwrap());
    }
    bits
}

fn load(seed: u64) -> Arc<Arena> {
    Arc::new(Arena::load(&SceneRef::Flat { seed }, BodySize::default()).unwrap())
}

/// For tests that do not ask whether a scene is made the same again.
static SCENE: LazyLock<Arc<Arena>> = LazyLock::new(|| load(SEED));

fn fresh(seed: u64) -> (Simulator, Episode) {
    start(load(seed), seed)
}

fn start(arena: Arc<Arena>, seed: u64) -> (Simulator, Episode) {
    let episode = episode::draw(&arena, seed, &EpisodeSpec::default()).unwrap();
    let mut simulator = Simulator::new(arena, SimConfig::default()).unwrap();
    simulator.reset(&episode).unwrap();
    (simulator, episode)
}

fn with_threads(n: usize) -> Bits {
    let pool = rayon::ThreadPoolBuilder::new().num_threads(n).build().unwrap();
    pool.install(|| {
        assert_eq!(rayon::current_num_threads(), n);
        run(&mut fresh(SEED).0)
    })
}

/// Says where two runs part rather than printing millions of numbers.
fn assert_same(a: &Bits, b: &Bits, what: &str) {
    assert_eq!(a.0.len(), b.0.len(), "{what}: one run said more");
    let parted = a.0.iter().zip(&b.0).position(|(x, y)| x != y);
    assert_eq!(parted, None, "{what}: the runs part at this number");
}

#[test]
fn the_same_seed_twice() {
    let ((mut a, episode_a), (mut b, episode_b)) = (fresh(SEED), fresh(SEED));
    assert_eq!(episode_a, episode_b);
    assert_same(&run(&mut a), &run(&mut b), "two simulators of one seed");
}

#[test]
fn after_a_reset() {
    let (mut simulator, episode) = start(Arc::clone(&SCENE), SEED);
    let first = run(&mut simulator);
    simulator.step_velocity(0.4, 1.0, Duration::from_millis(170)).unwrap();
    simulator.reset(&episode).unwrap();
    assert_same(&first, &run(&mut simulator), "before and after a reset");
}

#[test]
fn the_episode_as_json_is_the_same_episode() {
    let (_, episode) = start(Arc::clone(&SCENE), SEED);
    let json = serde_json::to_string(&episode).unwrap();
    assert_eq!(serde_json::from_str::<Episode>(&json).unwrap(), episode);
}

#[test]
fn one_thread_or_four() {
    assert_same(&with_threads(1), &with_threads(4), "one thread and four");
}

#[test]
fn another_seed_is_another_world() {
    let (a, b) = (start(Arc::clone(&SCENE), SEED).0, fresh(SEED + 1).0);
    let looks = [a, b].map(|mut s| s.observe().unwrap());
    assert_ne!(looks[0].frame.rgb, looks[1].frame.rgb);
    assert_ne!(looks[0].scan, looks[1].scan);
}
