//! The benchmark in one process and through real processes: the same episodes, actions and scores, bit for bit, oracles
//! included.
#![expect(clippy::unwrap_used, reason = "a test may fail by panicking")]

use std::collections::BTreeMap;
use std::path::Path;
use std::process::Command;

use homing_benchmark::EpisodeRecord;
use homing_benchmark::episode::StageSeconds;
use homing_benchmark::suite::store;
use homing_tests::processes::System;
use homing_tests::repository;

/// Exploring, an oracle that explores, an oracle that says where the goal is.
const ROWS: [&str; 3] = ["straight", "oracle-gd", "oracle-lm-pose"];

#[test]
fn the_suite_through_processes_is_the_suite_in_one() {
    // The processes have the machine for themselves.
    let system = System::new();
    let folder = tempfile::tempdir().unwrap();
    let here = suite(&folder.path().join("here"), &[]);
    let there = suite(&folder.path().join("there"), &["--through-processes"]);
    drop(system);
    assert_eq!(here.len(), ROWS.len());
    for (row, record) in &here {
        assert!(record.watch.n_steps >= 10, "{row}: {} steps show little", record.watch.n_steps);
        assert_eq!(format!("{record:?}"), format!("{:?}", there[row]), "{row}");
    }
    assert!(here["straight"].watch.n_steps > 40, "choose an episode with some exploring");
}

/// Runs the easy episode of every row, and returns what is kept of it, by row, without times.
fn suite(out: &Path, more: &[&str]) -> BTreeMap<String, EpisodeRecord> {
    let program = std::env::current_exe().unwrap().parent().unwrap().parent().unwrap().join("homing");
    let mut command = Command::new(program);
    command.current_dir(repository()).args(["bench", "tables", "--quick", "--no-clips", "--no-report"]);
    command.args(["--set", "flats-curved", "--level", "easy", "--threads", "1", "--out"]).arg(out).args(more);
    for row in ROWS {
        command.args(["--row", row]);
    }
    let output = command.output().unwrap();
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let records = store::read(out).unwrap();
    let timeless = |r: EpisodeRecord| EpisodeRecord { times: StageSeconds::default(), wall_s: 0.0, ..r };
    records.into_iter().map(|r| (r.cell.row.clone(), timeless(r))).collect()
}
