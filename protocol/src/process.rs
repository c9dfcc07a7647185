//! What every process does at its start and end: read its one configuration file, say what holds, and stop when told.

use std::error::Error;
use std::io::IsTerminal;
use std::ops::Deref;
use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::time::Duration;

use nix::sys::signal::{Signal, raise};
use serde::Deserialize;
use serde::de::DeserializeOwned;
use thiserror::Error;
use tokio::signal::unix::{SignalKind, signal};
use tracing_subscriber::EnvFilter;

use crate::session::{DEFAULT_ENDPOINT, Link, SessionConfig};

/// Exit code for a configuration that cannot be used (EX_CONFIG of sysexits).
pub const EXIT_CONFIG: u8 = 78;

/// The command line of every process.
#[derive(Clone, Debug, clap::Args)]
pub struct ProcessArgs {
    /// The process's TOML file; see deploy/.
    #[arg(long, value_name = "FILE")]
    pub config: PathBuf,
    /// End when standard input closes: whoever started this process is gone, however that came.
    #[arg(long)]
    pub until_stdin_closes: bool,
}

/// A configuration that reads well and cannot work: a process's body returns it to end with [`EXIT_CONFIG`].
#[derive(Debug, Error)]
#[error("the configuration cannot be used: {0}")]
pub struct Unusable(String);

impl Unusable {
    /// With the reason.
    pub fn new(cause: impl std::fmt::Display) -> Self {
        Self(cause.to_string())
    }
}

/// Why a configuration file cannot be read.
#[derive(Debug, Error)]
pub enum ConfigFileError {
    /// The file cannot be read.
    #[error("cannot read the configuration {}: {source}", path.display())]
    Read {
        /// The file.
        path: PathBuf,
        /// What the system says.
        source: std::io::Error,
    },
    /// It is not TOML, or has a key that does not exist.
    #[error("configuration {}: {cause}", path.display())]
    Parse {
        /// The file.
        path: PathBuf,
        /// Line, key and reason.
        cause: toml::de::Error,
    },
}

/// Reads one TOML file. Unknown keys are errors if the type says `deny_unknown_fields`.
///
/// # Errors
/// [`ConfigFileError`] with file, line, key and reason.
pub fn read_config<T: DeserializeOwned>(path: &Path) -> Result<T, ConfigFileError> {
    let text =
        std::fs::read_to_string(path).map_err(|source| ConfigFileError::Read { path: path.to_owned(), source })?;
    toml::from_str(&text).map_err(|cause| ConfigFileError::Parse { path: path.to_owned(), cause })
}

/// The whole of a process: its log, its configuration, its body, and the exit code for how that ended.
pub fn run<C, E>(args: &ProcessArgs, body: impl FnOnce(C) -> Result<(), E>) -> ExitCode
where
    C: DeserializeOwned + std::fmt::Debug,
    E: std::fmt::Display + Deref<Target = dyn Error + Send + Sync>,
{
    start_log();
    if args.until_stdin_closes {
        std::thread::spawn(end_with_stdin);
    }
    let config: C = match read_config(&args.config) {
        Ok(config) => config,
        Err(cause) => {
            tracing::error!("{cause}");
            return ExitCode::from(EXIT_CONFIG);
        }
    };
    tracing::info!(?config, "effective configuration");
    match body(config) {
        Ok(()) => ExitCode::SUCCESS,
        Err(cause) => {
            tracing::error!("{cause:#}");
            if cause.is::<Unusable>() { ExitCode::from(EXIT_CONFIG) } else { ExitCode::FAILURE }
        }
    }
}

/// Reads what nobody writes until the other end is gone, then stops this process as SIGTERM would.
fn end_with_stdin() {
    let _ = std::io::copy(&mut std::io::stdin().lock(), &mut std::io::sink());
    tracing::warn!("whoever started this process is gone: leaving");
    let _ = raise(Signal::SIGTERM);
}

/// The `[session]` table of every process.
#[derive(Clone, Debug, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct SessionSettings {
    /// Listen here and forward between the others: the body only.
    pub listen: Option<Vec<String>>,
    /// Connect to the body here.
    pub connect: Option<Vec<String>>,
    /// Robot namespace; empty for a lone robot.
    pub namespace: String,
    /// ROS domain.
    pub domain: usize,
    /// Hand large messages to processes of this host through shared memory.
    pub shared_memory: bool,
    /// Give up after so many seconds without the body.
    pub connect_timeout_s: u64,
}

impl Default for SessionSettings {
    fn default() -> Self {
        Self {
            listen: None,
            connect: None,
            namespace: String::new(),
            domain: 0,
            shared_memory: true,
            connect_timeout_s: 10,
        }
    }
}

impl SessionSettings {
    /// As the session of a body: it listens, on the default endpoint if none is named, unless told to connect.
    #[must_use]
    pub fn body(&self) -> SessionConfig {
        let listen = match (&self.listen, &self.connect) {
            (None, None) => Some(vec![DEFAULT_ENDPOINT.to_owned()]),
            _ => self.listen.clone(),
        };
        Self { listen, ..self.clone() }.session("body")
    }

    /// As a session of `node`: whoever does not listen connects, to the default endpoint if none is named.
    #[must_use]
    pub fn session(&self, node: &str) -> SessionConfig {
        let link = match &self.listen {
            Some(endpoints) => Link::Listen(endpoints.clone()),
            None => Link::Connect(self.connect.clone().unwrap_or_else(|| vec![DEFAULT_ENDPOINT.to_owned()])),
        };
        SessionConfig {
            node: node.to_owned(),
            namespace: self.namespace.clone(),
            domain: self.domain,
            link,
            connect_timeout: Duration::from_secs(self.connect_timeout_s),
            shared_memory: self.shared_memory,
        }
    }
}

/// Log lines go to stderr; RUST_LOG overrides what is shown.
pub fn start_log() {
    start_log_from("info");
}

/// The same, from this level on: `warn` for a program that opens the same models again and again.
pub fn start_log_from(level: &str) {
    let filter = EnvFilter::try_from_default_env().unwrap_or_else(|_| {
        EnvFilter::new(format!(
            "{level},zenoh=error,zenoh::net::routing=off,zenoh_transport=error,zenoh_shm=error,hiroz=error,\
             re_log_types=error,re_chunk=error,re_chunk_store=error,ort=error",
        ))
    });
    // A second call in one process changes nothing.
    let log = tracing_subscriber::fmt().with_env_filter(filter).with_target(false);
    let _ = log.with_ansi(std::io::stderr().is_terminal()).with_writer(std::io::stderr).try_init();
}

/// Waits for Ctrl-C or SIGTERM. From this call on, not only from the first poll, neither ends the process by itself. Needs
/// a tokio runtime.
///
/// # Errors
/// What the system says when it refuses to hand signals over.
pub fn termination() -> std::io::Result<impl Future<Output = ()>> {
    let (mut terminate, mut interrupt) = (signal(SignalKind::terminate())?, signal(SignalKind::interrupt())?);
    Ok(async move {
        tokio::select! {
            _ = terminate.recv() => {}
            _ = interrupt.recv() => {}
        }
        tracing::info!("told to stop: leaving");
    })
}
