//! Sending one topic.

use std::marker::PhantomData;
use std::sync::Arc;
use std::sync::atomic::{AtomicI64, Ordering};
use std::time::{SystemTime, UNIX_EPOCH};

use hiroz::entity::{EndpointEntity, EndpointKind, endpoint_gid};
use hiroz::node::ZNode;
use thiserror::Error;
use zenoh::Wait;
use zenoh::bytes::ZBytes;
use zenoh::liveliness::LivelinessToken;
use zenoh::qos::{CongestionControl, Priority};
use zenoh::shm::{PosixShmProviderBackend, ShmProvider};

use crate::topics::{Message, Qos, Topic};
use crate::wire;

/// Messages from this size on are written straight into shared memory, bytes.
const SHM_BYTES_MIN: usize = 32 << 10;

/// Why a message was not sent, or a sender not announced.
#[derive(Debug, Error)]
pub enum PublishError {
    /// zenoh refused the declaration.
    #[error("topic {topic} cannot be declared: {cause}")]
    Declare {
        /// Its name.
        topic: String,
        /// zenoh's words.
        cause: String,
    },
    /// The session is closed, or the message was refused.
    #[error("a message on {topic} was not sent: {cause}")]
    Put {
        /// Its name.
        topic: &'static str,
        /// zenoh's words.
        cause: String,
    },
}

/// Sends messages of one topic, as a ROS 2 publisher would.
pub struct Publisher<M> {
    inner: zenoh::pubsub::Publisher<'static>,
    // Announces the sender in the ROS graph for as long as it lives.
    _token: LivelinessToken,
    gid: [u8; 16],
    sequence: AtomicI64,
    topic: &'static str,
    shm: Option<Arc<ShmProvider<PosixShmProviderBackend>>>,
    message: PhantomData<fn(M)>,
}

impl<M: Message> Publisher<M> {
    pub(crate) fn declare(
        node: &ZNode,
        topic: &Topic<M>,
        shm: Option<Arc<ShmProvider<PosixShmProviderBackend>>>,
    ) -> Result<Self, PublishError> {
        let refused = |cause: String| PublishError::Declare { topic: topic.name.to_owned(), cause };
        let entity = endpoint::<M>(node, topic, EndpointKind::Publisher).map_err(refused)?;
        let gid = endpoint_gid(&entity).ok_or_else(|| refused("the node has no identity".to_owned()))?;
        let format = node.keyexpr_format();
        let key = format.topic_key_expr(&entity).map_err(|e| refused(e.to_string()))?;
        let token = format.liveliness_key_expr(&entity, &node.session().zid()).map_err(|e| refused(e.to_string()))?;
        let (congestion, priority, express) = transport(topic.qos);
        let inner = node
            .session()
            .declare_publisher((*key).clone())
            .congestion_control(congestion)
            .priority(priority)
            .express(express)
            .wait()
            .map_err(|e| refused(e.to_string()))?;
        let token =
            node.session().liveliness().declare_token((*token).clone()).wait().map_err(|e| refused(e.to_string()))?;
        Ok(Self {
            inner,
            _token: token,
            gid,
            sequence: AtomicI64::new(0),
            topic: topic.name,
            shm,
            message: PhantomData,
        })
    }

    /// Sends one message. Never waits for a slow reader.
    ///
    /// # Errors
    /// [`PublishError::Put`] when the session is closed.
    pub fn publish(&self, message: &M) -> Result<(), PublishError> {
        self.put(self.payload(message))
    }

    /// Sends bytes as they are, for tests of what receivers make of malformed ones.
    ///
    /// # Errors
    /// [`PublishError::Put`] when the session is closed.
    #[doc(hidden)]
    pub fn publish_bytes(&self, bytes: Vec<u8>) -> Result<(), PublishError> {
        self.put(bytes.into())
    }

    fn put(&self, payload: ZBytes) -> Result<(), PublishError> {
        let sequence = self.sequence.fetch_add(1, Ordering::Relaxed);
        let attachment = wire::attachment(sequence, unix_time_ns(), &self.gid);
        self.inner
            .put(payload)
            .attachment(&attachment[..])
            .wait()
            .map_err(|e| PublishError::Put { topic: self.topic, cause: e.to_string() })
    }

    /// One copy of the message: into shared memory where that exists and pays, else into fresh memory.
    fn payload(&self, message: &M) -> ZBytes {
        if let Some(provider) = &self.shm {
            let len = wire::encoded_len(message);
            if len >= SHM_BYTES_MIN
                && let Ok(mut memory) = provider.alloc(len).with_policy::<zenoh::shm::GarbageCollect>().wait()
                && wire::encode_into(message, &mut memory)
            {
                return memory.into();
            }
        }
        wire::encode(message).into()
    }
}

pub(crate) fn endpoint<M: Message>(
    node: &ZNode,
    topic: &Topic<M>,
    kind: EndpointKind,
) -> Result<EndpointEntity, String> {
    let qualified =
        hiroz::topic_name::qualify_topic_name(topic.name, node.namespace(), node.name()).map_err(|e| e.to_string())?;
    Ok(EndpointEntity {
        id: node.next_entity_id(),
        node: Some(node.node_entity().clone()),
        kind,
        topic: qualified,
        type_info: Some(M::type_info()),
        qos: Default::default(),
    })
}

/// Frames wait for nobody but may use the whole link; commands go first and alone; display gives way.
fn transport(qos: Qos) -> (CongestionControl, Priority, bool) {
    match qos {
        // Zenoh's Drop gives up on a fragmented message after 50 ms; BlockFirst keeps at most one waiting.
        Qos::Frame => (CongestionControl::BlockFirst, Priority::Data, false),
        Qos::Command => (CongestionControl::Drop, Priority::RealTime, true),
        Qos::State => (CongestionControl::Drop, Priority::InteractiveHigh, true),
        Qos::Display => (CongestionControl::Drop, Priority::DataLow, false),
    }
}

/// ROS tools show this; nothing here acts on it.
pub(crate) fn unix_time_ns() -> i64 {
    SystemTime::now().duration_since(UNIX_EPOCH).map_or(0, |d| i64::try_from(d.as_nanos()).unwrap_or(i64::MAX))
}
