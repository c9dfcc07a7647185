//! Receiving one topic: the newest wins, what is dropped is counted.

use std::collections::VecDeque;
use std::marker::PhantomData;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use hiroz::entity::EndpointKind;
use hiroz::node::ZNode;
use thiserror::Error;
use tokio::sync::Notify;
use zenoh::Wait;
use zenoh::bytes::ZBytes;
use zenoh::liveliness::LivelinessToken;
use zenoh::sample::Sample;

use crate::publisher::{endpoint, unix_time_ns};
use crate::topics::{Message, Topic};
use crate::wire;

/// Why a message could not be had.
#[derive(Debug, Error)]
pub enum ReceiveError {
    /// zenoh refused the declaration.
    #[error("topic {topic} cannot be subscribed to: {cause}")]
    Declare {
        /// Its name.
        topic: String,
        /// zenoh's words.
        cause: String,
    },
    /// Bytes that are not the topic's message.
    #[error("a message on {topic} is not a {message}: {cause}")]
    Malformed {
        /// Its name.
        topic: &'static str,
        /// ROS type expected.
        message: &'static str,
        /// What is wrong with it.
        cause: String,
    },
    /// More bytes than the topic allows.
    #[error("a message on {topic} has {bytes} bytes, {bytes_max} are allowed")]
    TooLarge {
        /// Its name.
        topic: &'static str,
        /// Its size.
        bytes: usize,
        /// The topic's limit.
        bytes_max: usize,
    },
}

/// A message as it came.
#[derive(Clone, Debug)]
pub struct Received<M> {
    /// The message.
    pub message: M,
    /// The sender's count of messages, if it gave one.
    pub sequence: Option<i64>,
    /// When it was sent by the sender's wall clock, ns since 1970, if it said so. Means something on one host only.
    pub sent_unix_ns: Option<i64>,
    /// When it arrived by this host's wall clock, ns since 1970.
    pub arrived_unix_ns: i64,
    /// Size on the wire.
    pub bytes: usize,
}

/// Counts of one subscription.
#[derive(Copy, Clone, Debug, Default, PartialEq, Eq)]
pub struct Counts {
    /// Messages that arrived.
    pub arrived: u64,
    /// Messages that gave way to newer ones here.
    pub displaced: u64,
}

/// Receives messages of one topic, as a ROS 2 subscription would.
pub struct Subscription<M> {
    _inner: zenoh::pubsub::Subscriber<()>,
    // Announces the receiver in the ROS graph for as long as it lives.
    _token: LivelinessToken,
    slot: Arc<Slot>,
    topic: &'static str,
    bytes_max: usize,
    message: PhantomData<fn() -> M>,
}

struct Slot {
    waiting: Mutex<Waiting>,
    arrival: Notify,
    depth: usize,
}

#[derive(Default)]
struct Waiting {
    samples: VecDeque<Arrival>,
    counts: Counts,
}

struct Arrival {
    payload: ZBytes,
    sequence_and_time: Option<(i64, i64)>,
    unix_ns: i64,
}

impl Slot {
    fn lock(&self) -> MutexGuard<'_, Waiting> {
        // A panic elsewhere cannot leave the queue half changed.
        self.waiting.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Runs on zenoh's thread: only swaps pointers.
    fn store(&self, sample: &Sample) {
        let sequence_and_time = sample.attachment().and_then(|a| wire::read_attachment(&a.to_bytes()));
        let arrival = Arrival { payload: sample.payload().clone(), sequence_and_time, unix_ns: unix_time_ns() };
        let mut waiting = self.lock();
        waiting.counts.arrived += 1;
        if waiting.samples.len() == self.depth {
            waiting.samples.pop_front();
            waiting.counts.displaced += 1;
        }
        waiting.samples.push_back(arrival);
        drop(waiting);
        self.arrival.notify_one();
    }
}

impl<M: Message> Subscription<M> {
    pub(crate) fn declare(node: &ZNode, topic: &Topic<M>, depth: usize) -> Result<Self, ReceiveError> {
        let refused = |cause: String| ReceiveError::Declare { topic: topic.name.to_owned(), cause };
        let entity = endpoint::<M>(node, topic, EndpointKind::Subscription).map_err(refused)?;
        let format = node.keyexpr_format();
        let key = format.topic_key_expr(&entity).map_err(|e| refused(e.to_string()))?;
        let token = format.liveliness_key_expr(&entity, &node.session().zid()).map_err(|e| refused(e.to_string()))?;
        let slot = Arc::new(Slot { waiting: Mutex::default(), arrival: Notify::new(), depth: depth.max(1) });
        let sink = Arc::clone(&slot);
        let inner = node
            .session()
            .declare_subscriber((*key).clone())
            .callback(move |sample| sink.store(&sample))
            .wait()
            .map_err(|e| refused(e.to_string()))?;
        let token =
            node.session().liveliness().declare_token((*token).clone()).wait().map_err(|e| refused(e.to_string()))?;
        Ok(Self {
            _inner: inner,
            _token: token,
            slot,
            topic: topic.name,
            bytes_max: topic.bytes_max,
            message: PhantomData,
        })
    }

    /// The oldest message waiting, if there is one.
    pub fn try_recv(&self) -> Option<Result<Received<M>, ReceiveError>> {
        let arrival = self.slot.lock().samples.pop_front()?;
        Some(self.read(&arrival))
    }

    /// The newest message waiting, if there is one; older ones are dropped and counted.
    pub fn try_latest(&self) -> Option<Result<Received<M>, ReceiveError>> {
        let arrival = {
            let mut waiting = self.slot.lock();
            let newest = waiting.samples.pop_back()?;
            waiting.counts.displaced += waiting.samples.len() as u64;
            waiting.samples.clear();
            newest
        };
        Some(self.read(&arrival))
    }

    /// Waits for the next message. Cancel-safe; bound it with `tokio::time::timeout`.
    ///
    /// # Errors
    /// [`ReceiveError`] for bytes that are not the topic's message; the next call goes on with the next message.
    pub async fn recv(&self) -> Result<Received<M>, ReceiveError> {
        loop {
            if let Some(received) = self.try_recv() {
                return received;
            }
            self.slot.arrival.notified().await;
        }
    }

    /// What arrived and what was dropped so far.
    #[must_use]
    pub fn counts(&self) -> Counts {
        self.slot.lock().counts
    }

    fn read(&self, arrival: &Arrival) -> Result<Received<M>, ReceiveError> {
        let bytes = arrival.payload.len();
        if bytes > self.bytes_max {
            return Err(ReceiveError::TooLarge { topic: self.topic, bytes, bytes_max: self.bytes_max });
        }
        let message = wire::decode(&arrival.payload).map_err(|cause| ReceiveError::Malformed {
            topic: self.topic,
            message: M::type_name(),
            cause,
        })?;
        Ok(Received {
            message,
            sequence: arrival.sequence_and_time.map(|(n, _)| n),
            sent_unix_ns: arrival.sequence_and_time.map(|(_, at)| at),
            arrived_unix_ns: arrival.unix_ns,
            bytes,
        })
    }
}
