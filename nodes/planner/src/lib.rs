//! homing-planner
