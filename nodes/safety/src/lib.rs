//! homing-safety
