//! homing-protocol
