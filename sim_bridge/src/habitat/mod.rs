//! Episodes in Habitat's file formats, read, placed in our scenes, and written.

pub mod axes;
