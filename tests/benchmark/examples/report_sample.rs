//! `report_sample FOLDER`: the benchmark's report made of invented episodes, to see what it looks like.
//!
//! Nothing in it was measured. Writes `report.html`, `report.md` and `report.json`.

use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;

use homing_benchmark::episode::StageSeconds;
use homing_benchmark::tables::{Report, RunInfo, clip_path};
use homing_benchmark::visual_target::report::{Cell, Column, MethodReport};
use homing_benchmark::visual_target::{Difficulty, Report as VisualTargetReport, Sensor};
use homing_benchmark::{Cause, CellKey, EpisodeRecord, Watch};
use homing_sim::episode::{Level, Shape};
use homing_sim::score::{Finish, Score};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

/// Rows, and the chance that one of them wins an easy, a medium and a hard episode.
const ROWS: [(&str, [f64; 3]); 16] = [
    ("frontier", [0.86, 0.78, 0.62]),
    ("straight", [0.45, 0.33, 0.18]),
    ("random", [0.62, 0.48, 0.31]),
    ("random-agent", [0.20, 0.05, 0.01]),
    ("mlp-switch", [0.82, 0.75, 0.58]),
    ("mlp-switch-no-recovery", [0.70, 0.60, 0.42]),
    ("sift", [0.78, 0.68, 0.50]),
    ("pose-noise", [0.85, 0.77, 0.60]),
    ("pose-depth-noise", [0.84, 0.78, 0.63]),
    ("oracle-lp", [0.88, 0.80, 0.64]),
    ("oracle-lm-pose", [0.93, 0.86, 0.72]),
    ("oracle-gd", [0.97, 0.95, 0.93]),
    ("epnp", [0.83, 0.76, 0.60]),
    ("sling-heading", [0.66, 0.55, 0.40]),
    ("no-recovery", [0.74, 0.63, 0.45]),
    ("sling-switch", [0.79, 0.70, 0.52]),
];
const LAYOUTS: [&str; 6] = ["Avonia_0.16", "Beechwood_1", "Cosmos & <Co>", "Elmira_0.3", "Hainesburg", "Wyatt_2"];

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let [folder] = arguments.as_slice() else { return Err("report_sample FOLDER".into()) };
    let folder = Path::new(folder);
    std::fs::create_dir_all(folder)?;
    let records = records();
    let report = Report::new(&info(&records), &records);
    std::fs::write(folder.join("report.html"), report.to_html()?)?;
    std::fs::write(folder.join("report.md"), report.to_markdown())?;
    std::fs::write(folder.join("report.json"), report.to_json()?)?;
    println!("{}", report.to_markdown());
    Ok(())
}

fn info(records: &[EpisodeRecord]) -> RunInfo {
    let clips: BTreeSet<String> = records.iter().step_by(3).map(clip_path).collect();
    RunInfo {
        command: "homing bench run --set flats-curved,layouts".to_owned(),
        commit: "0123abc".to_owned(),
        date: "2026-11-22".to_owned(),
        config: serde_json::json!({ "steps_max": 500, "success_m": 1.0, "camera": { "hfov_deg": 120, "width": 640 } }),
        machine: "a machine that does not exist".to_owned(),
        visual_target: Some(visual_target()),
        link: vec![(1.0, 0.52), (0.9, 0.51), (0.7, 0.47), (0.5, 0.38), (0.2, 0.12)],
        notes: vec!["INVENTED FIGURES: this page shows what a report looks like.".to_owned()],
        clips,
    }
}

fn records() -> Vec<EpisodeRecord> {
    let mut all = Vec::new();
    for (row, chances) in ROWS {
        for i in 0..300 {
            all.push(record(row, "flats-curved", &format!("flat seed {}", 300_000 + i), i, chances));
        }
    }
    for (row, chances) in &ROWS[..3] {
        for i in 0..180 {
            all.push(record(row, "layouts", LAYOUTS[i as usize % LAYOUTS.len()], i, chances.map(|c| 0.9 * c)));
        }
    }
    all
}

/// The episode is drawn from its number alone, what becomes of it from its number and a little from the row.
fn record(row: &str, set: &str, scene: &str, i: u64, chances: [f64; 3]) -> EpisodeRecord {
    let rng = &mut ChaCha8Rng::seed_from_u64(i);
    let level = (i % 3) as usize;
    let (from_m, to_m) = [(1.5, 3.0), (3.0, 5.0), (5.0, 10.0)][level];
    let shortest_path_m: f64 = rng.random_range(from_m..to_m);
    let (luck, own): (f64, u64) = (rng.random(), row.bytes().map(u64::from).sum());
    let rng = &mut ChaCha8Rng::seed_from_u64(1_000_003 * own + i);
    let won = 0.7 * luck + 0.3 * rng.random::<f64>() < chances[level];
    let left_m = if won { rng.random_range(0.02..0.4) } else { rng.random_range(1.2..6.0) };
    let path_length_m = shortest_path_m * rng.random_range(1.02..2.5);
    let steps = if won { (path_length_m * 7.0) as u64 + 10 } else { rng.random_range(300..500) };
    let finish = Finish {
        stopped: won,
        steps,
        last_mile_steps: steps / 5,
        path_length_m,
        shortest_path_m,
        final_distance_m: Some(left_m),
        final_straight_m: 0.8 * left_m,
        final_heading_error_rad: rng.random_range(-0.2..0.2),
        collisions: rng.random_range(0..8),
    };
    let truth = rng.random_range(-2.0..2.0_f64) * rng.random::<f64>();
    let wall_s = 0.05 * steps as f64;
    EpisodeRecord {
        cell: CellKey { row: row.to_owned(), set: set.to_owned() },
        scene: scene.to_owned(),
        episode_id: i.to_string(),
        level: Level::of(shortest_path_m),
        shape: Shape::Curved,
        strict: Score::strict(&finish),
        published: Score::published(&finish),
        cause: (!won).then(|| cause(rng.random_range(0..10))),
        reason: if won { "arrived".to_owned() } else { "gave up: nothing left to explore <10 cells & more".to_owned() },
        watch: Watch { n_steps: steps, ..Watch::default() },
        first_heading_rad: (!i.is_multiple_of(5)).then(|| (truth + rng.random_range(-0.08..0.08), truth)),
        times: StageSeconds {
            observe: 0.3 * wall_s,
            extract: 0.25 * wall_s,
            matching: 0.15 * wall_s,
            pose: 0.05 * wall_s,
            plan: 0.2 * wall_s,
        },
        wall_s,
    }
}

fn cause(i: u64) -> Cause {
    match i {
        0..4 => Cause::NeverInView,
        4..6 => Cause::NotMatched,
        6 => Cause::BadPose,
        7 => Cause::Stuck,
        8 => Cause::WrongStop,
        _ => Cause::Budget,
    }
}

fn visual_target() -> VisualTargetReport {
    let column = |d: Difficulty| Column {
        difficulty: d,
        n_pairs: 20,
        distance_m: d.published().distance_m,
        heading_deg: d.published().heading_deg,
        overlap: 0.3,
        target_seen: 0.5,
        published: d.published(),
    };
    let cell = |(difficulty, n_won): (Difficulty, usize)| Cell {
        difficulty,
        n_pairs: 20,
        success_rate: n_won as f64 / 20.0,
        success_rate_95: homing_benchmark::report::wilson_95(n_won, 20),
        final_distance_m: 1.5,
        final_heading_deg: 12.0,
        success_distance_m_median: Some(0.06),
        success_heading_deg_median: Some(0.8),
        losses: BTreeMap::new(),
    };
    let cells = Difficulty::ALL.into_iter().zip([19, 16, 12]).map(cell).collect();
    let method = MethodReport {
        name: "SuperPoint + LightGlue, multi-step".to_owned(),
        features: String::new(),
        solver: String::new(),
        sensor: Sensor::RgbD,
        cells,
        runs: Vec::new(),
    };
    VisualTargetReport {
        seed: 1,
        image_px: (640, 480),
        hfov_deg: 120.0,
        overlap_min: 0.1,
        columns: Difficulty::ALL.map(column).to_vec(),
        methods: vec![method],
        pairs: Vec::new(),
    }
}
