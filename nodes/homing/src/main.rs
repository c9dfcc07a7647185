//! The `homing` command: show a robot a photo, and it drives to where the photo was taken.

mod bench;
mod demo;
mod doctor;
mod export_pairs;
mod fleet;
mod goto;
mod latency;
mod meeting;
mod mission;
mod models;
mod photo;
mod replay;
mod run_folder;
mod scorer;
mod settings;
mod verdict;

use std::process::ExitCode;

use clap::{Parser, Subcommand};

/// Show a robot a photo, and it drives to the place where the photo was taken.
///
/// Exit codes: 0 the goal was reached (or all is well), 1 it was not, 2 it could not run (wrong usage, bad input, a process that
/// failed), 130 interrupted.
#[derive(Parser)]
#[command(name = "homing", version, arg_required_else_help = true)]
struct Args {
    #[command(subcommand)]
    command: Command,
}

#[derive(Subcommand)]
enum Command {
    /// Drive a simulated robot through a flat it has never seen, to the place of a photo.
    Demo(demo::DemoArgs),
    /// Send a photo to a running robot.
    Goto(goto::GotoArgs),
    /// Play a recording of real RGB-D frames through the same processes, and compare with the true poses.
    Replay(replay::ReplayArgs),
    /// Run many episodes in this process, and report success, SPL and final errors.
    Bench(bench::BenchArgs),
    /// Write pairs of RGB-D views with exact geometry, to train features and to measure them.
    ExportPairs(export_pairs::ExportPairsArgs),
    /// Say what is installed, which provider and GPU, ports and versions.
    Doctor(doctor::DoctorArgs),
    /// List the models that come with Homing, check them, and explain what a model of your own must take and give.
    Models(models::ModelsArgs),
}

/// How a command ended.
pub enum Ended {
    /// As wished.
    Well,
    /// It ran, and the goal was missed.
    Missed,
    /// Ctrl-C.
    Interrupted,
}

fn main() -> ExitCode {
    let command = Args::parse().command;
    // A benchmark opens its models again for every scene, and would say each time on what they run.
    homing_protocol::process::start_log_from(if matches!(command, Command::Bench(_)) { "warn" } else { "info" });
    leave_quietly_when_nobody_reads();
    let ended = match command {
        Command::Demo(args) => demo::run(args),
        Command::Goto(args) => goto::run(args),
        Command::Replay(args) => replay::run(args),
        Command::Bench(args) => bench::run(args),
        Command::ExportPairs(args) => export_pairs::run(args),
        Command::Doctor(args) => doctor::run(args),
        Command::Models(args) => models::run(args),
    };
    match ended {
        Ok(Ended::Well) => ExitCode::SUCCESS,
        Ok(Ended::Missed) => ExitCode::from(1),
        Ok(Ended::Interrupted) => ExitCode::from(130),
        Err(cause) => {
            eprintln!("homing: {}", in_words(&cause));
            ExitCode::from(2)
        }
    }
}

/// A reader that has seen enough, such as `head`, is no fault.
fn leave_quietly_when_nobody_reads() {
    let otherwise = std::panic::take_hook();
    std::panic::set_hook(Box::new(move |panic| {
        if panic.payload_as_str().is_some_and(|said| said.contains("Broken pipe")) {
            std::process::exit(0);
        }
        otherwise(panic);
    }));
}

/// An error and its causes, each once: many errors already say what caused them.
fn in_words(error: &anyhow::Error) -> String {
    let mut said = String::new();
    for cause in error.chain().map(ToString::to_string) {
        if said.is_empty() {
            said = cause;
        } else if !said.contains(&cause) {
            said = format!("{said}: {cause}");
        }
    }
    said
}
