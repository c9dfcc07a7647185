//! A frame with axes, a legend and marks, drawn as SVG.

use plotters::coord::Shift;
use plotters::prelude::*;
use plotters::style::text_anchor::{HPos, Pos, VPos};

use crate::perception::PlotError;
use crate::perception::plots::style::{GRID, INK, ink, pale};

/// Columns and rows; the page shows them at less than half the size.
const SIZE: (i32, i32) = (1280, 800);
const TITLE: u32 = 44;
const LETTERS: u32 = 33;
/// Width of a letter of that size, on average.
const LETTER_PX: i32 = 15;
const MARGIN: i32 = 28;
const LINE: i32 = 44;

/// A picture in its own coordinates.
#[derive(Clone, Debug, PartialEq)]
pub(in crate::tables) struct Picture {
    pub title: String,
    pub subtitle: String,
    pub x: Axis,
    pub y: Axis,
    pub legend: Vec<(String, RGBColor)>,
    pub marks: Vec<Mark>,
}

/// An axis, and where it is labelled.
#[derive(Clone, Debug, PartialEq)]
pub(in crate::tables) struct Axis {
    pub name: String,
    pub from: f64,
    pub to: f64,
    pub labels: Vec<(f64, String)>,
    pub lines: Lines,
}

/// Whether labels have lines across the picture.
#[derive(Copy, Clone, Debug, PartialEq, Eq)]
pub(in crate::tables) enum Lines {
    Drawn,
    None,
}

/// What is drawn, in the coordinates of the axes.
#[derive(Clone, Debug, PartialEq)]
pub(in crate::tables) enum Mark {
    /// From corner to corner.
    Box { from: (f64, f64), to: (f64, f64), colour: RGBColor, opacity: f64 },
    /// Through these points.
    Line { points: Vec<(f64, f64)>, colour: RGBColor },
    /// An interval on top of a bar.
    Whisker { x: f64, low: f64, high: f64 },
    /// A limit, from bottom to top.
    Limit { x: f64 },
    /// A disc.
    Dot { at: (f64, f64), colour: RGBColor },
    /// Words above a point.
    Above { at: (f64, f64), text: String },
    /// Words around a point, on this colour.
    Inside { at: (f64, f64), text: String, on: RGBColor },
}

/// Black or white, by how bright a colour looks (Rec. 709 weights).
fn readable_on(colour: RGBColor) -> &'static RGBColor {
    let RGBColor(r, g, b) = colour;
    let brightness = 0.2126 * f64::from(r) + 0.7152 * f64::from(g) + 0.0722 * f64::from(b);
    if brightness > 130.0 { &BLACK } else { &WHITE }
}

impl Axis {
    /// Percent from 0 to 100.
    pub fn percent(name: &str) -> Self {
        let labels = [0, 20, 40, 60, 80, 100].map(|p| (f64::from(p), p.to_string()));
        Self { name: name.to_owned(), from: 0.0, to: 100.0, labels: labels.to_vec(), lines: Lines::Drawn }
    }

    /// Names at 0.5, 1.5, 2.5 ...
    pub fn names(name: &str, names: Vec<String>) -> Self {
        let to = names.len().max(1) as f64;
        let labels = names.into_iter().enumerate().map(|(i, n)| (i as f64 + 0.5, n)).collect();
        Self { name: name.to_owned(), from: 0.0, to, labels, lines: Lines::None }
    }
}

type Area<'a> = DrawingArea<SVGBackend<'a>, Shift>;
type Failed = DrawingAreaErrorKind<std::io::Error>;

/// The rectangle between the axes, pixels.
struct Inside {
    left: i32,
    right: i32,
    top: i32,
    bottom: i32,
}

impl Picture {
    /// As SVG.
    ///
    /// # Errors
    /// [`PlotError`] when it cannot be drawn.
    pub fn draw(&self) -> Result<String, PlotError> {
        let mut svg = String::new();
        self.draw_into(&mut svg).map_err(PlotError::new)?;
        Ok(svg)
    }

    fn draw_into(&self, svg: &mut String) -> Result<(), Failed> {
        let area = SVGBackend::with_string(svg, (SIZE.0 as u32, SIZE.1 as u32)).into_drawing_area();
        area.draw(&Text::new(self.title.clone(), (MARGIN, 16), ink(TITLE)))?;
        area.draw(&Text::new(self.subtitle.clone(), (MARGIN, 66), pale(LETTERS)))?;
        let legend_bottom = self.draw_legend(&area)?;
        let longest = self.y.labels.iter().map(|(_, l)| l.chars().count()).max().unwrap_or(0) as i32;
        let inside = Inside {
            left: (MARGIN + 16 + LETTER_PX * longest).clamp(90, SIZE.0 / 2),
            right: SIZE.0 - 48,
            top: legend_bottom + LINE + 40,
            bottom: SIZE.1 - 108,
        };
        self.draw_axes(&area, &inside)?;
        for mark in &self.marks {
            self.draw_mark(&area, &inside, mark)?;
        }
        area.present()
    }

    /// Squares and names in lines below the subtitle; returns where they end.
    fn draw_legend(&self, area: &Area<'_>) -> Result<i32, Failed> {
        let (mut x, mut y) = (MARGIN, 116);
        for (name, colour) in &self.legend {
            let width = 72 + LETTER_PX * name.chars().count() as i32;
            if x + width > SIZE.0 && x > MARGIN {
                (x, y) = (MARGIN, y + LINE);
            }
            area.draw(&Rectangle::new([(x, y + 2), (x + 24, y + 26)], colour.filled()))?;
            area.draw(&Text::new(name.clone(), (x + 34, y), ink(LETTERS)))?;
            x += width;
        }
        Ok(if self.legend.is_empty() { 92 } else { y + 26 })
    }

    fn draw_axes(&self, area: &Area<'_>, inside: &Inside) -> Result<(), Failed> {
        let Inside { left, right, top, bottom } = *inside;
        let across = |from, to| PathElement::new(vec![from, to], GRID.stroke_width(2));
        let place = |style: TextStyle<'static>, h, v| style.pos(Pos::new(h, v));
        for (value, label) in &self.x.labels {
            let x = self.at(inside, (*value, self.y.from)).0;
            if self.x.lines == Lines::Drawn {
                area.draw(&across((x, top), (x, bottom)))?;
            }
            area.draw(&Text::new(label.clone(), (x, bottom + 12), place(pale(LETTERS), HPos::Center, VPos::Top)))?;
        }
        for (value, label) in &self.y.labels {
            let y = self.at(inside, (self.x.from, *value)).1;
            if self.y.lines == Lines::Drawn {
                area.draw(&across((left, y), (right, y)))?;
            }
            area.draw(&Text::new(label.clone(), (left - 14, y), place(pale(LETTERS), HPos::Right, VPos::Center)))?;
        }
        area.draw(&across((left, bottom), (right, bottom)))?;
        area.draw(&Text::new(self.y.name.clone(), (MARGIN, top - 52), ink(LETTERS)))?;
        let middle = ((left + right) / 2, bottom + 56);
        area.draw(&Text::new(self.x.name.clone(), middle, place(ink(LETTERS), HPos::Center, VPos::Top)))
    }

    fn draw_mark(&self, area: &Area<'_>, inside: &Inside, mark: &Mark) -> Result<(), Failed> {
        let at = |point: (f64, f64)| self.at(inside, point);
        let words = |point, text: &String, style: TextStyle<'static>, v, lift: i32| {
            let (x, y) = at(point);
            area.draw(&Text::new(text.clone(), (x, y - lift), style.pos(Pos::new(HPos::Center, v))))
        };
        match mark {
            Mark::Box { from, to, colour, opacity } => {
                area.draw(&Rectangle::new([at(*from), at(*to)], colour.mix(*opacity).filled()))
            }
            Mark::Line { points, colour } => {
                let points: Vec<(i32, i32)> = points.iter().map(|p| at(*p)).collect();
                area.draw(&PathElement::new(points, colour.stroke_width(5)))
            }
            Mark::Whisker { x, low, high } => {
                area.draw(&PathElement::new(vec![at((*x, *low)), at((*x, *high))], INK.stroke_width(3)))
            }
            Mark::Limit { x } => {
                let ends = vec![at((*x, self.y.from)), at((*x, self.y.to))];
                area.draw(&PathElement::new(ends, INK.stroke_width(2)))
            }
            Mark::Dot { at: point, colour } => area.draw(&Circle::new(at(*point), 9, colour.filled())),
            Mark::Above { at: point, text } => words(*point, text, ink(LETTERS - 5), VPos::Bottom, 6),
            Mark::Inside { at: point, text, on } => {
                words(*point, text, ink(LETTERS - 3).color(readable_on(*on)), VPos::Center, 0)
            }
        }
    }

    /// Pixels of a point; what lies outside is put on the edge.
    fn at(&self, inside: &Inside, (x, y): (f64, f64)) -> (i32, i32) {
        let along = |axis: &Axis, v: f64| ((v - axis.from) / (axis.to - axis.from)).clamp(0.0, 1.0);
        let (width, height) = (f64::from(inside.right - inside.left), f64::from(inside.bottom - inside.top));
        let (right, up) = ((along(&self.x, x) * width).round() as i32, (along(&self.y, y) * height).round() as i32);
        (inside.left + right, inside.bottom - up)
    }
}
