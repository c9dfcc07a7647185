//! Starts the processes of a system on this machine, watches them, and stops them in order.

use std::fs::File;
use std::os::unix::process::CommandExt;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, ExitStatus, Stdio};
use std::time::{Duration, Instant};

use anyhow::{Context, bail};
use nix::sys::signal::{Signal, kill};
use nix::unistd::Pid;

use crate::run_folder::{RunFolder, shown};

/// Lines of a dead process's log that are shown.
const LOG_TAIL: usize = 6;

/// Processes in the order they were started.
#[derive(Default)]
pub struct Fleet {
    members: Vec<Member>,
}

struct Member {
    name: &'static str,
    child: Child,
    log: PathBuf,
    mourned: bool,
}

/// A process that ended by itself.
pub struct Loss {
    pub name: &'static str,
    pub status: ExitStatus,
    pub last_words: String,
}

impl Fleet {
    /// Starts `binary` (beside this one) on a configuration; what it says goes into a log file of the run.
    pub fn start(&mut self, name: &'static str, binary: &str, config: &Path, folder: &RunFolder) -> anyhow::Result<()> {
        let program = beside_this(binary)?;
        let log = folder.file(&format!("{name}.log"));
        let sink = File::create(&log).with_context(|| format!("cannot write {}", log.display()))?;
        let child = Command::new(&program)
            .arg("--config")
            .arg(config)
            // A pipe that closes with this program, even if it is killed: the robot is not left driving.
            .arg("--until-stdin-closes")
            .stdin(Stdio::piped())
            // Ctrl-C in a terminal is for this program, which stops the others in order.
            .process_group(0)
            .stdout(sink.try_clone()?)
            .stderr(sink)
            .spawn()
            .with_context(|| format!("cannot start {}", program.display()))?;
        self.members.push(Member { name, child, log, mourned: false });
        Ok(())
    }

    /// The first process that ended since the last call.
    pub fn loss(&mut self) -> Option<Loss> {
        self.members.iter_mut().filter(|m| !m.mourned).find_map(|member| {
            let status = member.child.try_wait().ok().flatten()?;
            member.mourned = true;
            Some(Loss { name: member.name, status, last_words: tail(&member.log) })
        })
    }

    /// Asks a process to leave, and waits; kills it when the time is over.
    pub fn stop(&mut self, name: &str, limit: Duration) {
        for member in self.members.iter_mut().filter(|m| m.name == name) {
            member.mourned = true;
            leave(&mut member.child, limit);
        }
    }
}

impl Drop for Fleet {
    /// However this program ends on its own, no process is left behind: commanders first, the body last.
    fn drop(&mut self) {
        for member in self.members.iter().rev() {
            signal(&member.child, Signal::SIGTERM);
        }
        for member in self.members.iter_mut().rev() {
            leave(&mut member.child, Duration::from_secs(5));
        }
    }
}

fn leave(child: &mut Child, limit: Duration) {
    signal(child, Signal::SIGTERM);
    let deadline = Instant::now() + limit;
    while Instant::now() < deadline {
        if !matches!(child.try_wait(), Ok(None)) {
            return;
        }
        std::thread::sleep(Duration::from_millis(10));
    }
    let _ = child.kill();
    let _ = child.wait();
}

fn signal(child: &Child, signal: Signal) {
    if let Ok(pid) = i32::try_from(child.id()) {
        // One that has ended already needs no signal.
        let _ = kill(Pid::from_raw(pid), signal);
    }
}

fn beside_this(binary: &str) -> anyhow::Result<PathBuf> {
    let here = std::env::current_exe().context("cannot tell where this program is")?;
    let program = here.with_file_name(binary);
    if !program.is_file() {
        bail!("{} is missing: build the whole workspace (cargo build --workspace)", shown(&program));
    }
    Ok(program)
}

fn tail(log: &Path) -> String {
    let text = std::fs::read_to_string(log).unwrap_or_default();
    let errors: Vec<&str> = text.lines().filter(|line| line.contains("ERROR")).collect();
    let lines = if errors.is_empty() { text.lines().collect() } else { errors };
    lines[lines.len().saturating_sub(LOG_TAIL)..].join("\n")
}
