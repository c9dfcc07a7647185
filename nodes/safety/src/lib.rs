//! What stands between a command from the network and the motors. Every body's node, the simulator's included, passes its
//! commands through a [`Supervisor`].
//!
//! Pure: no I/O, no clock. `now` is always the body's own monotonic clock, the clock of the stamps on its observations;
//! a commander answers with the stamp of the observation it saw, so that no two machines' clocks are ever compared.
//!
//! What holds at every tick, whatever arrives, late, twice, out of order or not at all:
//! - I1: the ordered speed is zero within 300 ms of the last valid velocity command. A bounded motion (so many metres, so
//!   many radians) needs no stream: it ends by itself, watched by odometry, collision monitor and a deadline.
//! - I2: one commander at a time acts, and the epoch of the lease never decreases.
//! - I3: no command acts after its expiry, and none whose sequence is not above the last one accepted of its session.
//! - I4: nothing that is not finite or beyond the limits reaches the motors.
//! - I5: after silence stopped a stream, velocities act again only once the stream was healthy for a second.

pub mod collision;
pub mod config;
pub mod controller;
pub mod depth_scan;
pub mod gate;
pub mod limits;
pub mod order;
pub mod supervisor;
pub mod watchdog;

pub use collision::{CollisionConfig, CollisionMonitor, Passage};
pub use config::SupervisorConfig;
pub use controller::{Blocked, Control, ControllerConfig, MotionController};
pub use depth_scan::{DepthScanConfig, scan_from_depth};
pub use gate::{CommandGate, GateConfig, GateCounters, Lease, Refusal, Verdict};
pub use limits::{LimitsError, Velocity, VelocityLimits};
pub use order::{Dropped, Event, OrderCause, VelocityOrder};
pub use supervisor::Supervisor;
pub use watchdog::{StreamState, Watchdog, WatchdogConfig, ZeroVelocity};
