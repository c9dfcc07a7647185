//! `ablations FIRST N [NAME..]`: the episodes of N flats from seed FIRST, for every ablation or those named, on one thread.

use std::path::Path;

use homing_benchmark::{ABLATIONS, ablation, bench};

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let [first, n, names @ ..] = arguments.as_slice() else { return Err("ablations FIRST N [NAME..]".into()) };
    let (first, n): (u64, u64) = (first.parse()?, n.parse()?);
    let seeds: Vec<u64> = (first..first + n).collect();
    let all: Vec<String> = ABLATIONS.iter().map(|(name, _)| (*name).to_owned()).collect();
    for name in if names.is_empty() { &all } else { names } {
        let row = ablation(name, Path::new("nodes/perception/models"))?.ok_or("no such ablation")?;
        let report = bench(&seeds, &row.options(), &|row| {
            let (score, reason) = (&row.score, &row.reason);
            println!(
                "  {} {} spl {:.2} at {:.2} m, {} steps: {reason}",
                row.seed, score.success, score.spl, score.final_distance_m, score.steps
            );
        })?;
        println!("{name:24} success {:.2}, SPL {:.2}", report.success_rate, report.spl);
    }
    Ok(())
}
