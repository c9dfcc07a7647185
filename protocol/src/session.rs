//! Joining the network: explicit endpoints, no multicast, bounded waits.

use std::sync::Arc;
use std::time::Duration;

use hiroz::Builder;
use hiroz::context::{ZContext, ZContextBuilder};
use hiroz::msg::{ZDeserializer, ZMessage, ZService};
use hiroz::node::ZNode;
use serde::Deserialize;
use thiserror::Error;
use zenoh::shm::{PosixShmProviderBackend, ShmProvider, ShmProviderBuilder};
use zenoh::{Config, Wait};

use crate::publisher::{PublishError, Publisher};
use crate::service::{Server, ServiceError};
use crate::subscription::{ReceiveError, Subscription};
use crate::topics::{Message, Topic};

/// Where processes meet unless told otherwise.
pub const DEFAULT_ENDPOINT: &str = "tcp/127.0.0.1:7447";

/// Largest message accepted from the network, bytes. A raw 640x480 depth image has 1.2 MB.
const MESSAGE_BYTES_MAX: u64 = 16 << 20;

/// Shared memory set aside for outgoing frames, bytes.
const SHM_POOL_BYTES: usize = 32 << 20;

/// How a process takes part.
#[derive(Clone, Debug, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "snake_case", deny_unknown_fields)]
pub enum Link {
    /// The body's session: it listens and forwards between the others (a zenoh peer does not forward).
    Listen(Vec<String>),
    /// Everybody else.
    Connect(Vec<String>),
}

/// Settings of a session.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct SessionConfig {
    /// ROS node name: `perception`, `planner`, ...
    pub node: String,
    /// Robot namespace such as `robot1`; empty for a lone robot.
    pub namespace: String,
    /// ROS domain.
    pub domain: usize,
    /// Endpoints.
    pub link: Link,
    /// How long to wait for the router before giving up.
    pub connect_timeout: Duration,
    /// Offer shared memory to processes of this host.
    pub shared_memory: bool,
}

impl SessionConfig {
    /// A session of `node` with everything else at its default.
    #[must_use]
    pub fn new(node: &str, link: Link) -> Self {
        Self {
            node: node.to_owned(),
            namespace: String::new(),
            domain: 0,
            link,
            connect_timeout: Duration::from_secs(10),
            shared_memory: true,
        }
    }
}

/// Why a session could not be opened.
#[derive(Debug, Error)]
pub enum SessionError {
    /// The endpoint to listen on is taken or not ours.
    #[error("cannot listen on {endpoints}: {cause}. Is another robot or simulator running there? Choose another port")]
    Listen {
        /// The endpoints asked for.
        endpoints: String,
        /// zenoh's words.
        cause: String,
    },
    /// Nobody answers.
    #[error(
        "no robot answers at {endpoints} within {waited_s} s: {cause}. Start the robot or simulator first, or give its address"
    )]
    Connect {
        /// The endpoints asked for.
        endpoints: String,
        /// How long was waited, seconds.
        waited_s: u64,
        /// zenoh's words.
        cause: String,
    },
    /// No address.
    #[error("{endpoint:?} is not an endpoint: write tcp/HOST:PORT, {DEFAULT_ENDPOINT} for instance")]
    Endpoint {
        /// What was given.
        endpoint: String,
    },
    /// A setting zenoh does not take.
    #[error("session setting {key} = {value} is refused: {cause}")]
    Setting {
        /// Which.
        key: String,
        /// The value.
        value: String,
        /// zenoh's words.
        cause: String,
    },
    /// The node could not be announced.
    #[error("node {node} could not be announced: {cause}")]
    Node {
        /// Its name.
        node: String,
        /// hiroz's words.
        cause: String,
    },
}

/// A ROS 2 node on a zenoh session.
pub struct Session {
    context: ZContext,
    node: Arc<ZNode>,
    shm: Option<Arc<ShmProvider<PosixShmProviderBackend>>>,
}

impl Session {
    /// Opens the session and announces the node.
    ///
    /// # Errors
    /// [`SessionError`] when the endpoint is taken, nobody answers in time, or a setting is refused.
    pub fn open(config: &SessionConfig) -> Result<Self, SessionError> {
        let context = ZContextBuilder::default()
            .with_zenoh_config(zenoh_config(config)?)
            .with_domain_id(config.domain)
            .with_namespace(&config.namespace)
            .build()
            .map_err(|e| open_error(config, &e))?;
        let node = context
            .create_node(&config.node)
            .without_parameters()
            .build()
            .map_err(|e| SessionError::Node { node: config.node.clone(), cause: e.to_string() })?;
        let shm = if config.shared_memory { shm_provider() } else { None };
        Ok(Self { context, node: Arc::new(node), shm })
    }

    /// Announces a sender of `topic`.
    ///
    /// # Errors
    /// [`PublishError`] when zenoh refuses the declaration.
    pub fn publisher<M: Message>(&self, topic: &Topic<M>) -> Result<Publisher<M>, PublishError> {
        Publisher::declare(&self.node, topic, self.shm.clone())
    }

    /// Subscribes to `topic`, keeping the newest `depth` messages.
    ///
    /// # Errors
    /// [`ReceiveError`] when zenoh refuses the declaration.
    pub fn subscribe<M: Message>(&self, topic: &Topic<M>, depth: usize) -> Result<Subscription<M>, ReceiveError> {
        Subscription::declare(&self.node, topic, depth)
    }

    /// Announces a service.
    ///
    /// # Errors
    /// [`ServiceError`] when hiroz refuses the declaration.
    pub fn serve<S>(&self, name: &str) -> Result<Server<S>, ServiceError>
    where
        S: ZService + hiroz::ServiceTypeInfo,
        for<'a> <S::Request as ZMessage>::Serdes: ZDeserializer<Output = S::Request, Input<'a> = &'a [u8]>,
    {
        Server::declare(self, name)
    }

    /// True while some process announces itself as a sender of `topic`. Falls within 20 ms of a killed process.
    #[must_use]
    pub fn has_sender<M: Message>(&self, topic: &Topic<M>) -> bool {
        self.senders(topic) > 0
    }

    /// How many processes announce themselves as senders of `topic`.
    #[must_use]
    pub fn senders<M: Message>(&self, topic: &Topic<M>) -> usize {
        self.context
            .graph()
            .get_entities_by_topic(hiroz::entity::EndpointKind::Publisher, self.qualified(topic.name))
            .len()
    }

    /// The zenoh session underneath, for this crate's own measurements.
    #[doc(hidden)]
    #[must_use]
    pub fn zenoh(&self) -> &zenoh::Session {
        self.node.session()
    }

    /// The node, for services and actions of this crate.
    pub(crate) fn node(&self) -> &Arc<ZNode> {
        &self.node
    }

    /// Leaves the network. Errors while leaving have no one left to act on them.
    pub fn close(&self) {
        if let Err(cause) = self.context.shutdown() {
            tracing::debug!(%cause, "session closed uncleanly");
        }
    }

    fn qualified(&self, name: &str) -> String {
        match self.node.namespace() {
            "" | "/" => format!("/{name}"),
            namespace => format!("/{}/{name}", namespace.trim_matches('/')),
        }
    }
}

fn shm_provider() -> Option<Arc<ShmProvider<PosixShmProviderBackend>>> {
    match ShmProviderBuilder::default_backend(SHM_POOL_BYTES).wait() {
        Ok(provider) => Some(Arc::new(provider)),
        Err(cause) => {
            tracing::warn!(%cause, "no shared memory: frames go through the network stack");
            None
        }
    }
}

fn open_error(config: &SessionConfig, cause: &zenoh::Error) -> SessionError {
    // zenoh adds places in its own sources; what happened stands before them.
    let text = cause.to_string();
    let cause = text.split(" at /").next().unwrap_or(&text).to_owned();
    match &config.link {
        Link::Listen(endpoints) => SessionError::Listen { endpoints: endpoints.join(", "), cause },
        Link::Connect(endpoints) => {
            SessionError::Connect { endpoints: endpoints.join(", "), waited_s: config.connect_timeout.as_secs(), cause }
        }
    }
}

/// Only what differs from zenoh's defaults, and why.
fn zenoh_config(config: &SessionConfig) -> Result<Config, SessionError> {
    let (Link::Listen(endpoints) | Link::Connect(endpoints)) = &config.link;
    if let Some(endpoint) = endpoints.iter().find(|e| e.parse::<zenoh::config::EndPoint>().is_err()) {
        return Err(SessionError::Endpoint { endpoint: endpoint.clone() });
    }
    let (mode, listen, connect) = match &config.link {
        Link::Listen(endpoints) => ("router", json_list(endpoints), json_list(&[])),
        Link::Connect(endpoints) => ("client", json_list(&[]), json_list(endpoints)),
    };
    let settings = [
        ("mode", format!("\"{mode}\"")),
        ("listen/endpoints", listen),
        ("connect/endpoints", connect),
        // A wrong address is an error with a name, not an endless silence.
        ("connect/timeout_ms", config.connect_timeout.as_millis().to_string()),
        ("connect/exit_on_failure", "true".to_owned()),
        // After a restart of the router, back within half a second (default: 1 to 4 s).
        ("connect/retry", "{period_init_ms: 100, period_max_ms: 500, period_increase_factor: 2}".to_owned()),
        // Robots meet by address, never by shouting.
        ("scouting/multicast/enabled", "false".to_owned()),
        ("scouting/gossip/enabled", "false".to_owned()),
        // A dead link is noticed in 2 s (default 10 s).
        ("transport/link/tx/lease", "2000".to_owned()),
        // A declared length is memory: bounded (default 1 GiB).
        ("transport/link/rx/max_message_size", MESSAGE_BYTES_MAX.to_string()),
        ("transport/shared_memory/enabled", config.shared_memory.to_string()),
        ("queries_default_timeout", "5000".to_owned()),
    ];
    let mut zenoh_config = Config::default();
    for (key, value) in settings {
        zenoh_config.insert_json5(key, &value).map_err(|e| SessionError::Setting {
            key: key.to_owned(),
            value: value.clone(),
            cause: e.to_string(),
        })?;
    }
    Ok(zenoh_config)
}

fn json_list(endpoints: &[String]) -> String {
    let quoted: Vec<String> = endpoints.iter().map(|e| format!("{e:?}")).collect();
    format!("[{}]", quoted.join(", "))
}
