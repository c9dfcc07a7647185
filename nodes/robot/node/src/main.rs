//! homing-robot-node
fn main() {}
