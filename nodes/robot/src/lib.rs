//! homing-robot
