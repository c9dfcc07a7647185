//! homing-planner-node
fn main() {}
