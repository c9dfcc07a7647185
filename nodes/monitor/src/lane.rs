//! One sink behind a bounded queue of its own, so that a viewer that stalls does not cost the file anything, nor the
//! other way round.

use std::collections::VecDeque;
use std::fs::File;
use std::io::{self, BufWriter, Write};
use std::net::SocketAddr;
use std::path::Path;
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

use rerun::external::re_build_info::CrateVersion;
use rerun::external::re_log_encoding::{Encoder, EncodingOptions};
use rerun::grpc_server::GrpcServerSink;
use rerun::log::LogMsg;
use rerun::sink::{LogSink, SinkFlushError};
use rerun::{MemoryLimit, PlaybackBehavior, ServerOptions, SizeBytes as _};

use crate::recorder::SinkStatus;

/// Messages that may wait for one sink, bytes: some ten seconds of an episode.
const WAITING_MAX_BYTES: u64 = 64 << 20;

/// How long the server stays after the last message, so that connected viewers read it.
const SERVER_LINGER: Duration = Duration::from_millis(300);

/// Set once; waited for with a limit.
#[derive(Default)]
pub(crate) struct Latch {
    is_set: Mutex<bool>,
    changed: Condvar,
}

impl Latch {
    pub(crate) fn set(&self) {
        *self.is_set.lock().unwrap_or_else(PoisonError::into_inner) = true;
        self.changed.notify_all();
    }

    pub(crate) fn is_set(&self) -> bool {
        *self.is_set.lock().unwrap_or_else(PoisonError::into_inner)
    }

    pub(crate) fn wait_until(&self, deadline: Instant) {
        let limit = deadline.saturating_duration_since(Instant::now());
        let guard = self.is_set.lock().unwrap_or_else(PoisonError::into_inner);
        drop(self.changed.wait_timeout_while(guard, limit, |is_set| !*is_set));
    }
}

/// Where a lane's messages end up. Called from the lane's own thread only; may block.
pub(crate) trait Writer: Send + 'static {
    /// Writes a message and returns how many bytes that were.
    fn write(&mut self, message: LogMsg) -> Result<u64, String>;
    /// Nothing is waiting: a good moment to bring what is buffered to safety.
    fn idle(&mut self) -> Result<(), String>;
    /// Writes what belongs at the end.
    fn finish(self) -> Result<(), String>;
}

/// A sink with its queue and its thread.
pub(crate) struct Lane {
    shared: Arc<Shared>,
}

#[derive(Default)]
struct Shared {
    state: Mutex<State>,
    arrived: Condvar,
    done: Latch,
}

#[derive(Default)]
struct State {
    waiting: VecDeque<(u64, LogMsg)>,
    waiting_bytes: u64,
    closed: bool,
    status: SinkStatus,
}

impl Lane {
    pub(crate) fn spawn(name: String, writer: impl Writer) -> io::Result<Self> {
        let shared = Arc::new(Shared::default());
        shared.lock().status.name = name;
        let worker = shared.clone();
        let thread = std::thread::Builder::new().name("monitor-sink".to_owned());
        thread.spawn(move || worker.run(writer))?;
        Ok(Self { shared })
    }

    /// The stream's end of the lane; dropping it closes the lane.
    pub(crate) fn sink(&self) -> LaneSink {
        LaneSink { shared: self.shared.clone() }
    }

    pub(crate) fn status(&self) -> SinkStatus {
        self.shared.lock().status.clone()
    }

    /// True once the lane is closed and everything in it was written.
    pub(crate) fn is_complete(&self) -> bool {
        self.shared.done.is_set() && self.shared.lock().status.error.is_none()
    }

    pub(crate) fn wait_until(&self, deadline: Instant) {
        self.shared.done.wait_until(deadline);
    }
}

impl Shared {
    fn lock(&self) -> MutexGuard<'_, State> {
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }

    fn run(&self, mut writer: impl Writer) {
        let mut result = Ok(());
        while result.is_ok() {
            let next = { self.lock().pop() };
            result = match next {
                Some(message) => writer.write(message).map(|bytes| self.lock().status.bytes += bytes),
                None if self.lock().closed => break,
                None => {
                    let flushed = writer.idle();
                    self.wait();
                    flushed
                }
            };
        }
        if let Err(error) = result.and_then(|()| writer.finish()) {
            tracing::error!(sink = self.lock().status.name, error, "recording stopped");
            self.lock().fail(error);
        }
        self.done.set();
    }

    fn wait(&self) {
        let idle = |state: &mut State| state.waiting.is_empty() && !state.closed;
        drop(self.arrived.wait_while(self.lock(), idle));
    }
}

impl State {
    fn pop(&mut self) -> Option<LogMsg> {
        let (bytes, message) = self.waiting.pop_front()?;
        self.waiting_bytes -= bytes;
        Some(message)
    }

    fn push(&mut self, message: LogMsg) {
        let bytes = message.total_size_bytes();
        if self.status.error.is_some() || self.waiting_bytes + bytes > WAITING_MAX_BYTES {
            self.status.dropped += 1;
            return;
        }
        self.waiting_bytes += bytes;
        self.waiting.push_back((bytes, message));
    }

    fn fail(&mut self, error: String) {
        self.status.error = Some(error);
        self.status.dropped += self.waiting.len() as u64;
        self.waiting.clear();
        self.waiting_bytes = 0;
    }
}

/// What the SDK's stream writes to: takes a message or drops it, never waits.
pub(crate) struct LaneSink {
    shared: Arc<Shared>,
}

impl LogSink for LaneSink {
    fn send(&self, msg: LogMsg) {
        self.shared.lock().push(msg);
        self.shared.arrived.notify_one();
    }

    // The recorder waits for its lanes itself, with a limit; the stream must not, it knows none.
    fn flush_blocking(&self, _timeout: Duration) -> Result<(), SinkFlushError> {
        Ok(())
    }
}

impl Drop for LaneSink {
    fn drop(&mut self) {
        self.shared.lock().closed = true;
        self.shared.arrived.notify_all();
    }
}

/// Writes a recording (.rrd), compressed.
pub(crate) struct FileWriter {
    encoder: Encoder<BufWriter<File>>,
}

impl FileWriter {
    pub(crate) fn create(path: &Path) -> io::Result<Self> {
        let file = BufWriter::with_capacity(1 << 18, File::create(path)?);
        let encoder = Encoder::new_eager(CrateVersion::LOCAL, EncodingOptions::PROTOBUF_COMPRESSED, file);
        Ok(Self { encoder: encoder.map_err(io::Error::other)? })
    }
}

impl Writer for FileWriter {
    fn write(&mut self, message: LogMsg) -> Result<u64, String> {
        self.encoder.append(&message).map_err(|e| e.to_string())
    }

    fn idle(&mut self) -> Result<(), String> {
        self.encoder.flush_blocking().map_err(|e| e.to_string())
    }

    fn finish(mut self) -> Result<(), String> {
        self.encoder.finish().and_then(|()| self.encoder.flush_blocking()).map_err(|e| e.to_string())?;
        let file = self.encoder.into_inner().map_err(|e| e.to_string())?;
        file.into_inner().map_err(|e| e.to_string())?.flush().map_err(|e| e.to_string())
    }
}

/// Hands messages to a gRPC server that viewers connect to.
pub(crate) struct ServerWriter {
    server: GrpcServerSink,
}

impl ServerWriter {
    pub(crate) fn start(address: SocketAddr, memory_max_bytes: u64) -> Result<Self, std::net::AddrParseError> {
        let host = if address.is_ipv6() { format!("[{}]", address.ip()) } else { address.ip().to_string() };
        let options = ServerOptions {
            playback_behavior: PlaybackBehavior::OldestFirst,
            memory_limit: MemoryLimit::from_bytes(memory_max_bytes),
            cors_allowed_origins: Vec::new(),
        };
        Ok(Self { server: GrpcServerSink::new(&host, address.port(), options)? })
    }
}

impl Writer for ServerWriter {
    fn write(&mut self, message: LogMsg) -> Result<u64, String> {
        let bytes = message.total_size_bytes();
        self.server.send(message);
        Ok(bytes)
    }

    fn idle(&mut self) -> Result<(), String> {
        Ok(())
    }

    fn finish(self) -> Result<(), String> {
        self.server.flush_blocking(Duration::MAX).map_err(|e| e.to_string())?;
        std::thread::sleep(SERVER_LINGER);
        Ok(())
    }
}
