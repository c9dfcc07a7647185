//! Real processes on a port of their own: started, watched, and never left behind.

use std::fs::{self, File};
use std::path::{Path, PathBuf};
use std::process::{Child, ChildStdin, Command, ExitStatus, Stdio};
use std::time::{Duration, Instant};

use homing_protocol::{Link, Session, SessionConfig};
use homing_sim::episode::Episode;
use nix::sys::signal::{Signal, kill};
use nix::unistd::Pid;
use tempfile::TempDir;

use crate::{free_port, repository};

/// Long enough for anything on a busy machine; what takes longer is broken.
pub const LIMIT: Duration = Duration::from_secs(60);

/// The processes of a mission.
pub struct Everybody {
    /// The simulated body.
    pub body: Process,
    /// Perception.
    pub perception: Process,
    /// The planner.
    pub planner: Process,
}

/// A network and a folder for one test. Only one exists at a time, over all test programs: each test finds the processor
/// it is timed on.
pub struct System {
    folder: TempDir,
    port: u16,
    _turn: File,
}

impl System {
    /// Waits for its turn.
    #[expect(clippy::new_without_default, reason = "it waits, and takes a port")]
    pub fn new() -> Self {
        let target = target_folder().join("tmp");
        fs::create_dir_all(&target).unwrap();
        let turn = File::create(target.join("systems.lock")).unwrap();
        turn.lock().unwrap();
        let folder = tempfile::Builder::new().prefix("system-").tempdir_in(&target).unwrap();
        Self { folder, port: free_port(), _turn: turn }
    }

    /// Where its processes meet.
    pub fn endpoint(&self) -> String {
        format!("tcp/127.0.0.1:{}", self.port)
    }

    /// Port of the endpoint.
    pub fn port(&self) -> u16 {
        self.port
    }

    /// Writes a file into the system's folder.
    pub fn file(&self, name: &str, content: impl AsRef<[u8]>) -> PathBuf {
        let path = self.folder.path().join(name);
        fs::write(&path, content).unwrap();
        path
    }

    /// Starts the body: it listens. `settings` are lines of TOML before any table.
    pub fn body(&self, settings: &str) -> Process {
        self.start("homing-sim", &format!("{settings}\n[session]\nlisten = [\"{}\"]\n", self.endpoint()))
    }

    /// Starts a process that connects to the body.
    pub fn node(&self, binary: &str, settings: &str) -> Process {
        self.start(binary, &format!("{settings}\n[session]\nconnect = [\"{}\"]\n", self.endpoint()))
    }

    /// Starts body, perception and planner, one after the other, and waits until they are ready. `settings` are the body's.
    pub fn everybody(&self, episode: &Episode, settings: &str) -> Everybody {
        let file = self.file("episode.json", serde_json::to_string(episode).unwrap());
        let mut body = self.body(&format!("{settings}\nepisode = {file:?}"));
        body.says("the body is ready");
        let mut perception = self.node("homing-perception", "");
        perception.says("perception is ready");
        let mut planner = self.node("homing-planner", "");
        planner.says("planner is ready");
        Everybody { body, perception, planner }
    }

    /// Starts a process on a configuration.
    pub fn start(&self, binary: &str, config: &str) -> Process {
        let stem = format!("{binary}-{}", fs::read_dir(self.folder.path()).unwrap().count());
        let config = self.file(&format!("{stem}.toml"), config);
        let log = self.folder.path().join(format!("{stem}.log"));
        Process::start(binary, &[], &config, log)
    }

    /// Starts a process that leaves with whoever started it: when its standard input, given back here, closes.
    pub fn follower(&self, binary: &str, config: &str) -> (Process, ChildStdin) {
        let config = self.file("follower.toml", config);
        let log = self.folder.path().join("follower.log");
        let mut process = Process::start(binary, &["--until-stdin-closes"], &config, log);
        let stdin = process.child.stdin.take().unwrap();
        (process, stdin)
    }

    /// Joins the network as an operator.
    pub fn session(&self) -> Session {
        Session::open(&SessionConfig::new("operator", Link::Connect(vec![self.endpoint()]))).unwrap()
    }
}

/// One process. It is killed when this goes out of scope; if that is because the test failed, its log is shown.
pub struct Process {
    name: String,
    child: Child,
    log: PathBuf,
}

impl Process {
    fn start(binary: &str, flags: &[&str], config: &Path, log: PathBuf) -> Self {
        let program = program(binary);
        let child = Command::new(&program)
            // As an operator starts it: models are named relative to the repository.
            .current_dir(repository())
            .args(flags)
            .arg("--config")
            .arg(config)
            // The processes' own defaults are tested, not what this shell has set.
            .env_remove("RUST_LOG")
            .env("NO_COLOR", "1")
            // Open until it is taken, or the process is let go.
            .stdin(Stdio::piped())
            .stdout(Stdio::null())
            .stderr(File::create(&log).unwrap())
            .spawn()
            .unwrap_or_else(|e| panic!("{}: {e}", program.display()));
        Self { name: binary.to_owned(), child, log }
    }

    /// What it said so far.
    pub fn said(&self) -> String {
        fs::read_to_string(&self.log).unwrap()
    }

    /// Waits until its log holds these words, so many times.
    pub fn says_times(&mut self, words: &str, times: usize) -> &mut Self {
        let began = Instant::now();
        while self.said().matches(words).count() < times {
            let ended = self.child.try_wait().unwrap();
            assert!(ended.is_none(), "{} ended ({ended:?}) before it said '{words}'", self.name);
            assert!(began.elapsed() < LIMIT, "{} did not say '{words}' {times} times", self.name);
            std::thread::sleep(Duration::from_millis(10));
        }
        self
    }

    /// Waits until its log holds these words.
    pub fn says(&mut self, words: &str) -> &mut Self {
        self.says_times(words, 1)
    }

    /// Waits for its end.
    pub fn ends(&mut self) -> ExitStatus {
        let began = Instant::now();
        loop {
            if let Some(status) = self.child.try_wait().unwrap() {
                return status;
            }
            assert!(began.elapsed() < LIMIT, "{} does not end", self.name);
            std::thread::sleep(Duration::from_millis(10));
        }
    }

    /// Sends a signal.
    pub fn signal(&self, signal: Signal) {
        kill(Pid::from_raw(i32::try_from(self.child.id()).unwrap()), signal).unwrap();
    }
}

impl Drop for Process {
    fn drop(&mut self) {
        // One that has ended already needs no killing.
        let _ = self.child.kill();
        let _ = self.child.wait();
        if std::thread::panicking() {
            let text = fs::read_to_string(&self.log).unwrap_or_default();
            let lines: Vec<&str> = text.lines().collect();
            eprintln!("--- {}\n{}", self.name, lines[lines.len().saturating_sub(20)..].join("\n"));
        }
    }
}

/// The build's folder: test programs lie in `<target>/<profile>/deps`.
fn profile_folder() -> PathBuf {
    std::env::current_exe().unwrap().parent().and_then(Path::parent).unwrap().to_owned()
}

fn target_folder() -> PathBuf {
    profile_folder().parent().unwrap().to_owned()
}

/// A program of this workspace. Tests do not build it, so one that is older than its source is refused: what it does
/// would say nothing about the source.
fn program(binary: &str) -> PathBuf {
    let program = profile_folder().join(binary);
    let built = fs::metadata(&program).and_then(|m| m.modified());
    let built = built.unwrap_or_else(|_| panic!("{} is missing: cargo build --workspace", program.display()));
    let sources = fs::read_to_string(program.with_extension("d")).unwrap();
    let (_, sources) = sources.split_once(": ").unwrap();
    let newer = sources.split_whitespace().find(|file| {
        let changed = fs::metadata(file).and_then(|m| m.modified());
        changed.is_ok_and(|changed| changed > built)
    });
    if let Some(file) = newer {
        eprintln!("WARNING: {binary} is older than {file}: cargo build --workspace");
    }
    program
}
