//! Colours, sizes and letters that all pictures have in common.

use plotters::prelude::*;
use thiserror::Error;

/// A picture could not be drawn.
#[derive(Debug, Clone, PartialEq, Eq, Error)]
#[error("the picture cannot be drawn: {reason}")]
pub struct PlotError {
    reason: String,
}

impl PlotError {
    pub(crate) fn new(cause: impl core::fmt::Display) -> Self {
        Self { reason: cause.to_string() }
    }
}

/// Columns and rows of a picture.
pub(super) const SIZE: (u32, u32) = (960, 540);
/// Room for title and subtitle above the axes, pixels.
pub(super) const HEAD_PX: u32 = 84;
/// Letters and lines.
pub(crate) const INK: RGBColor = RGBColor(40, 44, 52);
const PALE: RGBColor = RGBColor(110, 116, 126);
/// Lines of the grid.
pub(crate) const GRID: RGBColor = RGBColor(225, 228, 232);
/// Told apart by those who do not see all colours, too (Okabe and Ito 2008).
const COLOURS: [RGBColor; 7] = [
    RGBColor(0, 114, 178),
    RGBColor(230, 159, 0),
    RGBColor(0, 158, 115),
    RGBColor(204, 121, 167),
    RGBColor(86, 180, 233),
    RGBColor(213, 94, 0),
    RGBColor(90, 90, 90),
];
/// Any system has one of these.
pub(crate) const LETTERS: &str = "Helvetica, Arial, DejaVu Sans, sans-serif";

/// The colour of the nth configuration.
pub(crate) fn colour(i: usize) -> RGBColor {
    COLOURS[i % COLOURS.len()]
}

/// Dark letters.
pub(crate) fn ink(size_px: u32) -> TextStyle<'static> {
    (LETTERS, size_px).into_font().color(&INK)
}

/// Letters that stand back.
pub(crate) fn pale(size_px: u32) -> TextStyle<'static> {
    (LETTERS, size_px).into_font().color(&PALE)
}
