//! `memory [N_EPISODES] [N_FLATS] [STEPS]`: memory of this process over many short episodes, one after the other, each in a
//! flat made anew (default 1000 episodes of 5 steps, cycling over 10 flats). Prints the resident set every 50 episodes, and
//! at the end how fast it grew over the second half: the slope of the least-squares line, kB an episode.

use std::sync::Arc;
use std::time::Instant;

use homing_benchmark::{Trial, run_episode};
use homing_perception::onnx::FeatureChoice;
use homing_perception::{AnyEstimator, PerceptionConfig};
use homing_planner::PlannerConfig;
use homing_sim::arena::{Arena, BodySize, SceneRef};
use homing_sim::episode::{EpisodeSpec, draw};

/// The first flat; the bench's own begin at 1000.
const FIRST_SEED: u64 = 400_000;
/// Episodes between two lines.
const EVERY: usize = 50;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let mut arguments = std::env::args().skip(1);
    let mut number = |default: u64| arguments.next().map_or(Ok(default), |n| n.parse());
    let (n_episodes, n_flats, steps) = (number(1000)?, number(10)?.max(1), number(5)?);
    let mut features = FeatureChoice::default();
    features.run.threads = 1;
    let perception = PerceptionConfig { threads: Some(1), ..PerceptionConfig::default() };
    let mut estimator = AnyEstimator::open(perception, &features)?;
    let planner = PlannerConfig { step_budget: steps, ..PlannerConfig::default() };
    let trial = Trial { planner, ..Trial::default() };
    let pool = rayon::ThreadPoolBuilder::new().num_threads(1).build()?;
    let begin = Instant::now();
    let mut resident_kb = Vec::new();
    for i in 0..n_episodes {
        let seed = FIRST_SEED + i % n_flats;
        pool.install(|| -> Result<(), Box<dyn std::error::Error + Send + Sync>> {
            let arena = Arc::new(Arena::load(&SceneRef::Flat { seed }, BodySize::default())?);
            let episode = draw(&arena, i, &EpisodeSpec::default())?;
            run_episode(&arena, &episode, &mut estimator, &trial, &mut |_| ())?;
            Ok(())
        })
        .map_err(|error| format!("flat {seed}, episode {i}: {error}"))?;
        resident_kb.push(resident()?);
        if resident_kb.len() % EVERY == 0 {
            let (n, kb) = (resident_kb.len(), resident_kb[resident_kb.len() - 1]);
            println!("{n:5} episodes, {:5.0} s, VmRSS {kb:.0} kB", begin.elapsed().as_secs_f64());
        }
    }
    let half = &resident_kb[resident_kb.len() / 2..];
    println!(
        "{n_episodes} episodes of {steps} steps over {n_flats} flats: the second half grew by {:.2} kB an episode; {:.0} to {:.0} kB",
        slope(half),
        half.iter().copied().fold(f64::INFINITY, f64::min),
        half.iter().copied().fold(0.0, f64::max)
    );
    Ok(())
}

/// Of the least-squares line through values at 0, 1, 2 ...
fn slope(values: &[f64]) -> f64 {
    let mean = |v: &mut dyn Iterator<Item = f64>| v.sum::<f64>() / values.len() as f64;
    let (x_mean, y_mean) = (0.5 * (values.len() as f64 - 1.0), mean(&mut values.iter().copied()));
    let xy = mean(&mut values.iter().enumerate().map(|(x, y)| (x as f64 - x_mean) * (y - y_mean)));
    let xx = mean(&mut (0..values.len()).map(|x| (x as f64 - x_mean).powi(2)));
    xy / xx
}

/// Memory of this process that is in RAM, kB.
fn resident() -> Result<f64, Box<dyn std::error::Error>> {
    let status = std::fs::read_to_string("/proc/self/status")?;
    let line = status.lines().find_map(|l| l.strip_prefix("VmRSS:")).ok_or("no VmRSS in /proc/self/status")?;
    Ok(line.trim().trim_end_matches(" kB").parse()?)
}
