//! The pictures of the report. [`Picture`] is a frame and marks in its coordinates; the files beside it make one each.

mod causes;
mod distances;
mod errors;
mod headings;
mod link;
mod picture;

pub(super) use causes::causes;
pub(super) use distances::distances;
pub(super) use errors::{FinalErrors, final_errors, heading_errors, positions};
pub(super) use headings::headings;
pub(super) use link::link;
pub(super) use picture::Picture;
