//! homing-perception-node
fn main() {}
