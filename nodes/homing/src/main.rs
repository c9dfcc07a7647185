//! homing
fn main() {}
