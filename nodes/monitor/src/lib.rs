//! homing-monitor
