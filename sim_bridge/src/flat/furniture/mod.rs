//! Furniture. Every piece is drawn in its own frame: the middle of its back edge is the origin, x runs along the back, y
//! points to its front (into the room, where it stands against a wall), z up.

mod decor;
mod seating;
mod sleeping;
mod storage;
mod wet;

use rand_chacha::ChaCha8Rng;

pub(super) use decor::{poster, rug};

use super::pen::Pen;
use super::style::{RoomStyle, Style};

/// A kind of furniture.
#[derive(Copy, Clone, Debug, PartialEq)]
pub(super) enum Piece {
    /// Seats, so many.
    Sofa(u32),
    /// One seat.
    Armchair,
    /// Low, before a sofa.
    CoffeeTable,
    /// Low, with a screen.
    TvStand,
    /// Open shelf with books, so wide in metres.
    Bookshelf(f64),
    /// Doors, high.
    Wardrobe(f64),
    /// Doors, waist-high.
    Sideboard(f64),
    /// Narrow, for corridors.
    ShoeCabinet,
    /// Drawers.
    Nightstand,
    /// So wide in metres.
    Bed(f64),
    /// With chair and screen.
    Desk,
    /// Table with so many chairs along each long side.
    DiningSet(u32),
    /// Counter with oven and sink, and cupboards above, so wide in metres.
    Kitchen(f64),
    /// The same without cupboards above, so that it fits below a window.
    Counter(f64),
    /// Below a window.
    Radiator,
    /// A fridge.
    Fridge,
    /// A washing machine.
    Washer,
    /// A bath tub.
    Bath,
    /// A toilet.
    Toilet,
    /// A basin with a mirror.
    Basin,
    /// A pot with leaves.
    Plant,
    /// A standing lamp.
    FloorLamp,
    /// Boxes and a basket.
    Boxes,
}

impl Piece {
    /// Width along the back, depth, height, metres.
    pub fn size(self) -> (f64, f64, f64) {
        match self {
            Piece::Sofa(seats) => (0.4 + 0.62 * f64::from(seats), 0.9, 0.8),
            Piece::Armchair => (0.85, 0.85, 0.8),
            Piece::CoffeeTable => (0.95, 0.55, 0.42),
            Piece::TvStand => (1.5, 0.42, 1.25),
            Piece::Bookshelf(w) => (w, 0.3, 1.95),
            Piece::Wardrobe(w) => (w, 0.6, 2.1),
            Piece::Sideboard(w) => (w, 0.42, 0.85),
            Piece::ShoeCabinet => (0.8, 0.24, 0.95),
            Piece::Nightstand => (0.45, 0.4, 0.75),
            Piece::Bed(w) => (w, 2.08, 0.95),
            Piece::Desk => (1.3, 1.1, 1.2),
            Piece::DiningSet(n) => (0.25 + 0.62 * f64::from(n), 1.7, 0.9),
            Piece::Kitchen(w) => (w, 0.62, 2.1),
            Piece::Counter(w) => (w, 0.62, 1.15),
            Piece::Radiator => (0.9, 0.12, 0.68),
            Piece::Fridge => (0.62, 0.65, 1.8),
            Piece::Washer => (0.6, 0.58, 0.85),
            Piece::Bath => (1.65, 0.75, 0.58),
            Piece::Toilet => (0.4, 0.68, 0.8),
            Piece::Basin => (0.6, 0.48, 1.75),
            Piece::Plant => (0.5, 0.5, 1.1),
            Piece::FloorLamp => (0.34, 0.34, 1.6),
            Piece::Boxes => (0.9, 0.45, 0.75),
        }
    }

    /// True if people move it now and then; false for what is fixed to walls and pipes.
    pub fn is_loose(self) -> bool {
        use Piece::{Basin, Bath, Counter, Fridge, Kitchen, Radiator, Toilet, Washer};
        !matches!(self, Kitchen(_) | Counter(_) | Radiator | Fridge | Washer | Bath | Toilet | Basin)
    }

    /// Draws it. What it is made of comes from the room; chance decides small things.
    pub fn build(self, pen: &mut Pen<'_>, style: &Style, look: &RoomStyle, rng: &mut ChaCha8Rng) {
        match self {
            Piece::Sofa(seats) => seating::sofa(pen, seats, look),
            Piece::Armchair => seating::armchair(pen, look),
            Piece::CoffeeTable => seating::coffee_table(pen, look, style, rng),
            Piece::DiningSet(n) => seating::dining_set(pen, n, look, style, rng),
            Piece::Desk => seating::desk(pen, look, style, rng),
            Piece::TvStand => storage::tv_stand(pen, look, style, rng),
            Piece::Bookshelf(w) => storage::bookshelf(pen, w, look, style, rng),
            Piece::Wardrobe(w) => storage::wardrobe(pen, w, look, style),
            Piece::Sideboard(w) => storage::sideboard(pen, w, look, style, rng),
            Piece::ShoeCabinet => storage::shoe_cabinet(pen, look, style),
            Piece::Nightstand => storage::nightstand(pen, look, style),
            Piece::Boxes => storage::boxes(pen, look, style, rng),
            Piece::Bed(w) => sleeping::bed(pen, w, look, style),
            Piece::Kitchen(w) => wet::kitchen(pen, w, look, style, rng),
            Piece::Counter(w) => wet::counter(pen, w, look, style),
            Piece::Radiator => decor::radiator(pen, style),
            Piece::Fridge => wet::fridge(pen, style),
            Piece::Washer => wet::washer(pen, style),
            Piece::Bath => wet::bath(pen, style),
            Piece::Toilet => wet::toilet(pen, style),
            Piece::Basin => wet::basin(pen, look, style),
            Piece::Plant => decor::plant(pen, style, rng),
            Piece::FloorLamp => decor::floor_lamp(pen, look, style),
        }
    }
}
