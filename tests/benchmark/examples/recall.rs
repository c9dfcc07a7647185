//! `recall FIRST_SEED N [EXTRACTOR MATCHER]`: how often a photo of a place that was passed is found in memory alone, over N
//! flats, and how long it takes.

use std::path::Path;

use homing_benchmark::recall::{RecallRow, RecallSpec, recall};
use homing_perception::memory::MemoryConfig;
use homing_perception::onnx::FeatureChoice;
use homing_perception::{PerceptionConfig, Registration};

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let [first, n, features @ ..] = arguments.as_slice() else {
        return Err("recall FIRST_SEED N [EXTRACTOR MATCHER]".into());
    };
    let (first, n): (u64, u64) = (first.parse()?, n.parse()?);
    let choice = match features {
        [extractor, matcher] => FeatureChoice::listed(extractor, Some(matcher), Path::new("nodes/perception/models"))?,
        _ => FeatureChoice::default(),
    };
    let mut total = RecallRow::default();
    for seed in first..first + n {
        let mut registration = Registration::open(PerceptionConfig::default(), MemoryConfig::default(), &choice)?;
        let row = recall(seed, &RecallSpec::default(), &mut registration)?;
        println!(
            "flat {seed}: {} frames, {} keyframes; {} photos, {} right, {} wrong",
            row.n_frames, row.n_keyframes, row.n_photos, row.n_right, row.n_wrong
        );
        total.n_photos += row.n_photos;
        total.n_right += row.n_right;
        total.n_wrong += row.n_wrong;
        total.seconds.extend(row.seconds);
    }
    total.seconds.sort_by(f64::total_cmp);
    let p = |share: f64| total.seconds.get((share * total.seconds.len() as f64) as usize).copied().unwrap_or(f64::NAN);
    println!(
        "{} photos: {:.3} right, {:.3} wrong; {:.0} ms a photo (p50), {:.0} ms (p95)",
        total.n_photos,
        total.n_right as f64 / total.n_photos.max(1) as f64,
        total.n_wrong as f64 / total.n_photos.max(1) as f64,
        1e3 * p(0.5),
        1e3 * p(0.95)
    );
    Ok(())
}
