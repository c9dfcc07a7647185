//! What crosses the network, and the only library that names zenoh.
//!
//! `topics` is the system on a page; `convert` has one file per arrow between domain values and ROS 2 messages;
//! `session`, `publisher` and `subscription` carry them; `navigate` is the action. The wire is rmw_zenoh's: CDR
//! payloads, ROS 2 keys, liveliness tokens and attachments, so that ROS 2 tools see everything.

pub mod assemble;
pub mod body;
pub mod convert;
pub mod interfaces;
pub mod navigate;
pub mod process;
pub mod publisher;
pub mod service;
pub mod session;
pub mod subscription;
pub mod topics;
mod wire;

// The generated interfaces look for it at the crate's root.
#[doc(hidden)]
pub use hiroz_msgs::size_estimation;

pub use assemble::FrameAssembler;
pub use body::BodyPublishers;
pub use convert::{Malformed, ToDomain, ToMessage};
pub use publisher::{PublishError, Publisher};
pub use session::{Link, Session, SessionConfig, SessionError};
pub use subscription::{ReceiveError, Received, Subscription};
pub use topics::Topic;
