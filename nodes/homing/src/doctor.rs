//! `homing doctor`: what is here, what is missing, and what to do about it.

use std::net::TcpListener;
use std::path::{Path, PathBuf};
use std::process::Command;

use clap::Args;
use homing_perception::{find_runtime, load_runtime};
use serde::Serialize;

use crate::Ended;

/// Says what is installed, which provider and GPU, ports and versions. Exit code 1 if something needed is missing.
#[derive(Args)]
pub struct DoctorArgs {
    /// Print the findings as JSON.
    #[arg(long)]
    json: bool,
}

/// One thing looked at.
#[derive(Serialize)]
struct Finding {
    what: &'static str,
    state: State,
    found: String,
}

#[derive(Copy, Clone, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
enum State {
    Good,
    /// Works without, with less.
    Absent,
    /// Does not work without.
    Missing,
}

const BINARIES: [&str; 5] = ["homing-sim", "homing-robot", "homing-perception", "homing-planner", "homing-monitor"];

pub fn run(args: DoctorArgs) -> anyhow::Result<Ended> {
    let findings = [processes(), opencv(), onnx_runtime(), gpu(), viewer(), port(), shared_memory(), data()];
    if args.json {
        println!("{}", serde_json::to_string(&findings)?);
    } else {
        println!("homing {}\n", env!("CARGO_PKG_VERSION"));
        for finding in &findings {
            let mark = match finding.state {
                State::Good => "ok",
                State::Absent => "--",
                State::Missing => "MISSING",
            };
            println!("  {mark:<8} {:<16} {}", finding.what, finding.found);
        }
    }
    let missing = findings.iter().any(|f| f.state == State::Missing);
    Ok(if missing { Ended::Missed } else { Ended::Well })
}

fn finding(what: &'static str, state: State, found: impl Into<String>) -> Finding {
    Finding { what, state, found: found.into() }
}

fn processes() -> Finding {
    let here = std::env::current_exe().unwrap_or_default();
    let absent: Vec<&str> = BINARIES.into_iter().filter(|b| !here.with_file_name(b).is_file()).collect();
    if absent.is_empty() {
        return finding("processes", State::Good, BINARIES.join(", "));
    }
    finding(
        "processes",
        State::Missing,
        format!("{}: build the whole workspace (cargo build --workspace)", absent.join(", ")),
    )
}

fn opencv() -> Finding {
    match homing_perception::opencv_version() {
        Ok(version) => finding("OpenCV", State::Good, version),
        Err(cause) => finding("OpenCV", State::Missing, cause.to_string()),
    }
}

fn onnx_runtime() -> Finding {
    let Some(library) = find_runtime() else {
        return finding(
            "ONNX Runtime",
            State::Absent,
            "not found: run ./deploy/demo once, or set ORT_DYLIB_PATH (only learned features need it)",
        );
    };
    match load_runtime(&library) {
        Ok(report) => {
            let providers: Vec<&str> = report.providers.iter().filter(|(_, has)| *has).map(|(name, _)| *name).collect();
            finding("ONNX Runtime", State::Good, format!("{}, providers: {}", report.version, providers.join(", ")))
        }
        Err(cause) => finding("ONNX Runtime", State::Absent, cause.to_string()),
    }
}

fn gpu() -> Finding {
    match first_line("nvidia-smi", &["--query-gpu=name,driver_version,memory.total", "--format=csv,noheader"]) {
        Some(line) => finding("GPU", State::Good, line),
        None => finding("GPU", State::Absent, "none (nvidia-smi answers nothing): perception runs on the CPU"),
    }
}

fn viewer() -> Finding {
    let own = Path::new(".venv/bin/rerun");
    let program = if own.is_file() { own.display().to_string() } else { "rerun".to_owned() };
    match first_line(&program, &["--version"]) {
        Some(line) => finding("rerun viewer", State::Good, line),
        None => finding(
            "rerun viewer",
            State::Absent,
            "not found: recordings are written, but not shown (pip install rerun-sdk==0.36.3)",
        ),
    }
}

fn port() -> Finding {
    match TcpListener::bind(("127.0.0.1", 7447)) {
        Ok(_) => finding("port 7447", State::Good, "free"),
        Err(cause) => {
            finding("port 7447", State::Absent, format!("{cause}: a robot is running, or give another with --endpoint"))
        }
    }
}

fn shared_memory() -> Finding {
    match std::fs::metadata("/dev/shm") {
        Ok(meta) if meta.is_dir() => finding("shared memory", State::Good, "/dev/shm"),
        _ => finding("shared memory", State::Absent, "no /dev/shm: frames go through the network stack"),
    }
}

fn data() -> Finding {
    let folder = std::env::var_os("HOMING_DATA").map_or_else(|| PathBuf::from("../shared/data"), PathBuf::from);
    if folder.is_dir() {
        return finding("test data", State::Good, folder.display().to_string());
    }
    finding(
        "test data",
        State::Absent,
        format!("{} does not exist: tests on real images are skipped", folder.display()),
    )
}

fn first_line(program: &str, arguments: &[&str]) -> Option<String> {
    let output = Command::new(program).args(arguments).output().ok().filter(|o| o.status.success())?;
    String::from_utf8_lossy(&output.stdout).lines().next().map(|line| line.trim().to_owned())
}
