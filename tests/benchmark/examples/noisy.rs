//! `noisy FIRST_SEED N [NOISE ..]`: N episodes of the benchmark under each kind of noise, and how far the odometry is off at
//! their ends, and how often the robot turned to each side.

use std::sync::Arc;

use homing_benchmark::Policy;
use homing_benchmark::episode::run_episode_as;
use homing_core::{Action, PlanarPose, Transform, wrap_angle};
use homing_perception::onnx::FeatureChoice;
use homing_perception::{AnyEstimator, PerceptionConfig};
use homing_planner::PlannerConfig;
use homing_sim::scene::World;
use homing_sim::{Arena, BodySize, EpisodeSpec, NoisePreset, SceneRef, SimConfig, episode};

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let [first, n, names @ ..] = arguments.as_slice() else { return Err("noisy FIRST_SEED N [NOISE ..]".into()) };
    let (first, n): (u64, u64) = (first.parse()?, n.parse()?);
    let presets: Vec<NoisePreset> = match names {
        [] => NoisePreset::ALL.to_vec(),
        names => names.iter().map(|name| name.parse()).collect::<Result<_, _>>()?,
    };
    let mut estimator = AnyEstimator::open(PerceptionConfig::default(), &FeatureChoice::default())?;
    for seed in first..first + n {
        let arena = Arc::new(Arena::load(&SceneRef::Flat { seed }, BodySize::default())?);
        let episode = episode::draw(&arena, seed, &EpisodeSpec::default())?;
        for preset in &presets {
            let robot = SimConfig { noise: preset.config(), ..SimConfig::default() };
            let (mut start, mut off, mut jumps, mut turns) = (None, (0.0, 0.0), 0, (0, 0));
            let (config, discovery) = (PlannerConfig::default(), Policy::default().build());
            let run = run_episode_as(robot, &arena, &episode, &mut estimator, config, discovery, &mut |step| {
                let start = *start.get_or_insert(step.pose_truth);
                let truth = relative(&start, &step.pose_truth);
                let believed = step.observation.odometry.t_odom_base.planar();
                let turned_rad = wrap_angle(believed.yaw_rad - truth.yaw_rad);
                off = (believed.distance_to(truth.x_m, truth.y_m), turned_rad.to_degrees());
                turns.0 += u32::from(step.action == Action::TurnLeft);
                turns.1 += u32::from(step.action == Action::TurnRight);
                if step.state.reason.contains("jumped") {
                    jumps += 1;
                    println!("    {} jumps at {believed:?}", step.state.stamp.seconds());
                }
            })?;
            println!(
                "flat {seed} {:15} {} after {:3} steps, {:.2} m from the goal, {:2} collisions; odometry off by {:.2} m \
                 and {:.1} degrees after {turns:?} turns, {jumps} jumps; {:?}: {}",
                preset.name(),
                if run.score.success { "success" } else { "failure" },
                run.score.steps,
                run.score.final_distance_m,
                run.score.collisions,
                off.0,
                off.1,
                run.mode,
                run.reason
            );
        }
    }
    Ok(())
}

/// A pose as seen from another, both in the world frame.
fn relative(from: &PlanarPose, to: &PlanarPose) -> PlanarPose {
    let (from, to): (Transform<World, World>, Transform<World, World>) = (from.to_transform(), to.to_transform());
    (from.inverse() * to).planar()
}
