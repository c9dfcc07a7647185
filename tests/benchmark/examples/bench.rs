//! `bench FIRST LAST [straight] [--json FILE] [--threads N]`: the benchmark over a range of seeds.

use homing_benchmark::{BenchOptions, EpisodeRow, Policy, bench};
use indicatif::{ProgressBar, ProgressStyle};

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let numbers: Vec<u64> = arguments.iter().map_while(|a| a.parse().ok()).collect();
    let &[first, last] = numbers.as_slice() else { return Err("which seeds? FIRST LAST".into()) };
    let after = |flag: &str| arguments.iter().skip_while(|a| *a != flag).nth(1);
    let straight = arguments.iter().any(|a| a == "straight");
    let options = BenchOptions {
        policy: if straight { Policy::Straight } else { Policy::Frontier },
        threads: after("--threads").map_or(Ok(0), |n| n.parse())?,
        ..BenchOptions::default()
    };
    let seeds: Vec<u64> = (first..=last).collect();
    let bar = ProgressBar::new(seeds.len() as u64).with_style(ProgressStyle::with_template("{pos}/{len} {eta} {msg}")?);
    println!("{}", EpisodeRow::HEADER);
    let report = bench(&seeds, &options, &|row| {
        bar.inc(1);
        if bar.is_hidden() { println!("{row}") } else { bar.println(row.to_string()) }
    })?;
    bar.finish_and_clear();
    println!("\n{report}");
    if let Some(path) = after("--json") {
        std::fs::write(path, report.to_json()?)?;
    }
    Ok(())
}
