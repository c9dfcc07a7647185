//! homing-monitor-node
fn main() {}
