//! The recorder: takes updates without ever making the caller wait, and shows them in a thread of its own.

use std::io;
use std::net::{SocketAddr, TcpListener};
use std::path::PathBuf;
use std::process::{Child, Command, Stdio};
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::{Duration, Instant};

use rerun::log::ChunkBatcherConfig;
use rerun::sink::{LogSink, MultiSink};
use rerun::{ApplicationId, RecordingStream, RecordingStreamBuilder};
use thiserror::Error;

use crate::blueprint;
use crate::lane::{FileWriter, Lane, Latch, ServerWriter};
use crate::queue::{Kind, Queue};
use crate::scene::Scene;
use crate::update::Update;

/// What to record, and where to show it. A recorder without file and server takes updates and shows nothing.
#[derive(Clone, Debug)]
pub struct RecorderConfig {
    /// Groups recordings in the viewer: its layout is remembered per application.
    pub application_id: String,
    /// Writes a recording (.rrd) here; an old one is replaced.
    pub recording: Option<PathBuf>,
    /// Serves viewers here: `rerun rerun+http://host:port/proxy` connects, and may do so late. Port 0 takes a free one.
    pub serve: Option<SocketAddr>,
    /// A viewer that connects late sees at most this much of the past, bytes.
    pub serve_memory_max_bytes: u64,
    /// Starts this viewer program (`rerun`) on what is served; serves on a free local port if `serve` says nothing.
    pub viewer: Option<PathBuf>,
    /// Images, scans and maps are shown at most this often, wall-clock hertz.
    pub image_rate_hz_max: f64,
    /// Quality of the camera images in the recording, 1 to 100.
    pub jpeg_quality: u8,
    /// Radius of the robot's footprint on the map, metres.
    pub robot_radius_m: f64,
}

impl Default for RecorderConfig {
    fn default() -> Self {
        Self {
            application_id: "homing".to_owned(),
            recording: None,
            serve: None,
            serve_memory_max_bytes: 512 << 20,
            viewer: None,
            image_rate_hz_max: 10.0,
            jpeg_quality: 80,
            robot_radius_m: 0.18,
        }
    }
}

/// Why a recorder cannot start.
#[derive(Debug, Error)]
pub enum RecorderError {
    /// The recording's file cannot be made.
    #[error("cannot write the recording {}: {source}; name a file in a folder that exists and is writable", path.display())]
    Recording {
        /// The file.
        path: PathBuf,
        /// What the system says.
        source: io::Error,
    },
    /// The address for viewers cannot be used.
    #[error("cannot serve viewers on {address}: {source}; choose another port")]
    Serve {
        /// The address.
        address: SocketAddr,
        /// What the system says.
        source: io::Error,
    },
    /// The viewer does not start.
    #[error("cannot start the viewer {}: {source}", path.display())]
    Viewer {
        /// The program.
        path: PathBuf,
        /// What the system says.
        source: io::Error,
    },
    /// The SDK or the system refuses.
    #[error("cannot start the recorder: {what}")]
    Start {
        /// What failed.
        what: String,
    },
}

/// How the recorder is doing.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Status {
    /// Updates taken out of the queue and shown or thinned out.
    pub shown: u64,
    /// Updates lost because the recorder's thread did not keep up, by kind; kinds that lost nothing are left out.
    pub dropped: Vec<(Kind, u64)>,
    /// The file and the server, as far as asked for.
    pub sinks: Vec<SinkStatus>,
    /// True once everything accepted has reached every sink. Only [`Recorder::finish`] can make it so.
    pub complete: bool,
}

impl Status {
    /// The first thing that went wrong, if something did.
    #[must_use]
    pub fn error(&self) -> Option<&str> {
        self.sinks.iter().find_map(|sink| sink.error.as_deref())
    }
}

/// How one sink is doing.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct SinkStatus {
    /// The file's path or the server's address.
    pub name: String,
    /// Bytes written to the file, or handed to the server.
    pub bytes: u64,
    /// Messages lost because the sink did not keep up or has failed.
    pub dropped: u64,
    /// Why nothing reaches it any more: a full disk, a server that died.
    pub error: Option<String>,
}

/// Shows and records an episode. Shared by reference between threads; dropping it finishes it within two seconds.
pub struct Recorder {
    queue: Arc<Queue>,
    shown: Arc<AtomicU64>,
    drained: Arc<Latch>,
    lanes: Vec<Lane>,
    address: Option<SocketAddr>,
    finished: bool,
}

impl Recorder {
    /// Opens the sinks and starts the recorder's threads.
    ///
    /// # Errors
    /// [`RecorderError`] when the file cannot be made, the address is taken, or the viewer does not start.
    pub fn new(config: RecorderConfig) -> Result<Self, RecorderError> {
        let address = serve_address(&config)?;
        let lanes = open_lanes(&config, address)?;
        let stream = open_stream(&config, &lanes)?;
        blueprint::send(&stream, &config.application_id).map_err(|e| RecorderError::Start { what: e.to_string() })?;
        let recorder = Self {
            queue: Arc::default(),
            shown: Arc::default(),
            drained: Arc::default(),
            lanes,
            address,
            finished: false,
        };
        recorder.spawn_drain(Scene::new(stream, &config))?;
        if let (Some(path), Some(url)) = (&config.viewer, recorder.url()) {
            spawn_viewer(path, &url).map_err(|source| RecorderError::Viewer { path: path.clone(), source })?;
        }
        Ok(recorder)
    }

    /// Takes an update. Never waits for a sink: where the recorder does not keep up, the oldest update of the same kind
    /// is lost and counted.
    pub fn offer(&self, update: impl Into<Update>) {
        self.queue.push(update.into());
    }

    /// What a viewer connects to: `rerun rerun+http://host:port/proxy`. `None` if nothing is served.
    #[must_use]
    pub fn url(&self) -> Option<String> {
        self.address.map(|address| {
            let host = if address.ip().is_unspecified() { "127.0.0.1".to_owned() } else { host_of(address) };
            format!("rerun+http://{host}:{}/proxy", address.port())
        })
    }

    /// Updates and messages lost so far, at the queue and at the sinks.
    #[must_use]
    pub fn dropped(&self) -> u64 {
        self.queue.dropped().iter().sum::<u64>() + self.lanes.iter().map(|lane| lane.status().dropped).sum::<u64>()
    }

    /// How the recorder is doing.
    #[must_use]
    pub fn status(&self) -> Status {
        let dropped = self.queue.dropped();
        let by_kind = Kind::ALL.into_iter().zip(dropped).filter(|(_, n)| *n > 0).collect();
        Status {
            shown: self.shown.load(Ordering::Relaxed),
            dropped: by_kind,
            sinks: self.lanes.iter().map(Lane::status).collect(),
            complete: self.drained.is_set() && self.lanes.iter().all(Lane::is_complete),
        }
    }

    /// Takes no more updates, and waits until what was taken has reached the sinks, at most `limit`. A sink that is
    /// stuck is left behind: the status says so.
    pub fn finish(mut self, limit: Duration) -> Status {
        self.close(limit);
        self.status()
    }

    fn close(&mut self, limit: Duration) {
        if std::mem::replace(&mut self.finished, true) {
            return;
        }
        let deadline = Instant::now() + limit;
        self.queue.close();
        self.drained.wait_until(deadline);
        for lane in &self.lanes {
            lane.wait_until(deadline);
        }
    }

    fn spawn_drain(&self, mut scene: Scene) -> Result<(), RecorderError> {
        let (queue, shown, drained) = (self.queue.clone(), self.shown.clone(), self.drained.clone());
        let drain = move || {
            scene.begin();
            while let Some(update) = queue.pop() {
                scene.show(update);
                shown.fetch_add(1, Ordering::Relaxed);
            }
            // Dropping the last handle of the stream hands its rest to the lanes and closes them.
            drop(scene);
            drained.set();
        };
        let thread = std::thread::Builder::new().name("monitor".to_owned());
        thread.spawn(drain).map(drop).map_err(|e| RecorderError::Start { what: e.to_string() })
    }
}

impl Drop for Recorder {
    fn drop(&mut self) {
        self.close(Duration::from_secs(2));
    }
}

fn host_of(address: SocketAddr) -> String {
    if address.is_ipv6() { format!("[{}]", address.ip()) } else { address.ip().to_string() }
}

/// Binds once to see that the port is free: the SDK's server only logs that it is not.
fn serve_address(config: &RecorderConfig) -> Result<Option<SocketAddr>, RecorderError> {
    let local = SocketAddr::from(([127, 0, 0, 1], 0));
    let Some(address) = config.serve.or(config.viewer.as_ref().map(|_| local)) else { return Ok(None) };
    let bound = TcpListener::bind(address).and_then(|listener| listener.local_addr());
    bound.map(Some).map_err(|source| RecorderError::Serve { address, source })
}

fn open_lanes(config: &RecorderConfig, address: Option<SocketAddr>) -> Result<Vec<Lane>, RecorderError> {
    let mut lanes = Vec::new();
    if let Some(path) = &config.recording {
        let writer =
            FileWriter::create(path).map_err(|source| RecorderError::Recording { path: path.clone(), source })?;
        lanes.push(Lane::spawn(path.display().to_string(), writer));
    }
    if let Some(address) = address {
        let writer = ServerWriter::start(address, config.serve_memory_max_bytes)
            .map_err(|what| RecorderError::Start { what: what.to_string() })?;
        lanes.push(Lane::spawn(address.to_string(), writer));
    }
    lanes.into_iter().collect::<io::Result<_>>().map_err(|e| RecorderError::Start { what: e.to_string() })
}

fn open_stream(config: &RecorderConfig, lanes: &[Lane]) -> Result<RecordingStream, RecorderError> {
    // A tick of 50 ms: fresh to the eye, and twenty chunks a second and entity at most.
    let batching = ChunkBatcherConfig { flush_tick: Duration::from_millis(50), ..ChunkBatcherConfig::DEFAULT };
    let sinks: Vec<Box<dyn LogSink>> = lanes.iter().map(|lane| Box::new(lane.sink()) as Box<dyn LogSink>).collect();
    let stream = RecordingStreamBuilder::new(ApplicationId::new_or_unknown(&config.application_id))
        .batcher_config(batching)
        .buffered()
        .map_err(|e| RecorderError::Start { what: e.to_string() })?;
    stream.set_log_tick_enabled(false);
    stream.set_log_time_enabled(false);
    stream.set_sink(Box::new(MultiSink::new(sinks)));
    Ok(stream)
}

fn spawn_viewer(path: &PathBuf, url: &str) -> io::Result<Child> {
    // The viewer is the user's window: it outlives the episode and is not waited for.
    Command::new(path).arg(url).stdin(Stdio::null()).stdout(Stdio::null()).stderr(Stdio::null()).spawn()
}
