//! homing-sim-node
fn main() {}
