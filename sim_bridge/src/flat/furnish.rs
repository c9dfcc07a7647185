//! Where furniture stands: against walls, before other furniture or in the open, and never in anybody's way.

use rand::RngExt;
use rand_chacha::ChaCha8Rng;

use super::furniture::Piece;
use super::geometry::{Rect, Side, Spot};
use super::layout::{Room, RoomKind};
use super::passable::Passable;
use super::shell::{OpeningKind, Walls};

/// A piece and where it stands.
#[derive(Clone, Debug)]
pub(super) struct Placed {
    /// What.
    pub piece: Piece,
    /// The middle of its back edge.
    pub spot: Spot,
}

/// A span of wall that is taken, metres along it and up.
#[derive(Copy, Clone, Debug)]
pub(super) struct Span {
    /// Along the wall.
    pub along: (f64, f64),
    /// Up.
    pub height: (f64, f64),
}

/// A room while it is being filled.
pub(super) struct Furnishing<'a> {
    room: &'a Room,
    passable: Passable,
    taken: Vec<Rect>,
    /// What of each wall is hidden or cut away, by [`Side::ALL`].
    pub spans: [Vec<Span>; 4],
    /// What stands in the room so far.
    pub placed: Vec<Placed>,
    /// Rugs: centre, size, metres.
    pub rugs: Vec<(Spot, (f64, f64))>,
}

/// Depth kept free before a door, metres.
const DOOR_ZONE_M: f64 = 0.75;
/// Attempts for each piece.
const TRIES: usize = 30;
/// Share of the loose pieces that stand elsewhere in another state of the room.
const MOVED_SHARE: f64 = 0.4;

impl<'a> Furnishing<'a> {
    /// An empty room with its doors.
    pub fn new(room: &'a Room, walls: &Walls) -> Self {
        let mut taken = Vec::new();
        let mut doors = Vec::new();
        let mut spans: [Vec<Span>; 4] = Default::default();
        for (k, side) in Side::ALL.into_iter().enumerate() {
            let frame = room.floor.side(side);
            for o in &walls.openings[k] {
                spans[k].push(Span { along: (o.along.0 - 0.08, o.along.1 + 0.08), height: o.height });
                if o.kind == OpeningKind::Passage {
                    taken.push(frame.rect((o.along.0 - 0.1, o.along.1 + 0.1), (0.0, DOOR_ZONE_M)));
                    doors.push(frame.point(0.5 * (o.along.0 + o.along.1), 0.4));
                }
            }
            for leaf in &walls.leaves[k] {
                spans[k].push(Span { along: *leaf, height: (0.0, 2.05) });
                taken.push(frame.rect(*leaf, (0.0, 0.12)));
            }
        }
        let passable = Passable::new(room.floor, doors);
        Self { room, passable, taken, spans, placed: Vec::new(), rugs: Vec::new() }
    }

    /// Fills the room by what it is for.
    pub fn furnish(&mut self, rng: &mut ChaCha8Rng) {
        match self.room.kind {
            RoomKind::Living => self.living(rng),
            RoomKind::Kitchen => self.kitchen(rng),
            RoomKind::Bedroom => self.bedroom(1.6, rng),
            RoomKind::Child => self.bedroom(0.95, rng),
            RoomKind::Bath => self.bath(rng),
            RoomKind::Study => self.study(rng),
            RoomKind::Dining => self.dining(rng),
            RoomKind::Storage => self.storage(rng),
            RoomKind::Corridor => self.corridor(rng),
        }
        self.radiators(rng);
    }

    /// Another state of the room, with some of its loose pieces elsewhere: where each of [`Self::placed`] stands in it, or
    /// `None` if there was no other place for it.
    pub fn rearranged(&self, walls: &Walls, rng: &mut ChaCha8Rng) -> Vec<Option<Spot>> {
        let moved: Vec<bool> = self.placed.iter().map(|p| p.piece.is_loose() && rng.random_bool(MOVED_SHARE)).collect();
        let mut room = Furnishing::new(self.room, walls);
        let both = || self.placed.iter().zip(&moved);
        let mut spots: Vec<Option<Spot>> =
            both().map(|(p, moved)| if *moved { None } else { room.stand(p.piece, p.spot) }).collect();
        for (spot, (placed, _)) in spots.iter_mut().zip(both()).filter(|(_, (_, moved))| **moved) {
            *spot = match placed.piece {
                Piece::DiningSet(_) => room.in_the_open(placed.piece, rng),
                piece => room.against_a_wall(piece, rng).map(|(_, spot)| spot),
            };
        }
        spots
    }

    fn living(&mut self, rng: &mut ChaCha8Rng) {
        let seats = if self.room.floor.area() > 18.0 { 3 } else { 2 };
        if let Some((side, spot)) = self.against_a_wall(Piece::Sofa(seats), rng) {
            self.lay_rug(spot.shifted(0.0, 1.45), (2.4, 1.6));
            self.stand(Piece::CoffeeTable, spot.shifted(0.0, 1.25));
            let across = self.room.floor.side_length(side);
            let along = across - self.room.floor.side(side).local(spot.x, spot.y).0;
            if self.at_wall(Piece::TvStand, side.opposite(), along).is_none() {
                self.against_a_wall(Piece::TvStand, rng);
            }
        }
        self.several(&[Piece::Bookshelf(1.2), Piece::Armchair, Piece::Plant, Piece::FloorLamp], rng);
        if self.room.floor.area() > 17.0 {
            self.a_table(2, rng);
            self.several(&[Piece::Sideboard(1.4), Piece::Bookshelf(0.9), Piece::Armchair, Piece::Plant], rng);
        }
    }

    fn kitchen(&mut self, rng: &mut ChaCha8Rng) {
        let counters = [Piece::Kitchen(3.0), Piece::Kitchen(2.4), Piece::Counter(2.4), Piece::Counter(1.8)];
        counters.into_iter().find(|piece| self.against_a_wall(*piece, rng).is_some());
        self.several(&[Piece::Fridge], rng);
        self.a_table(if self.room.floor.area() > 13.0 { 3 } else { 2 }, rng);
        self.several(&[Piece::Counter(1.2), Piece::Sideboard(1.2), Piece::Washer, Piece::Plant], rng);
    }

    fn bedroom(&mut self, bed: f64, rng: &mut ChaCha8Rng) {
        if let Some((_, spot)) = self.against_a_wall(Piece::Bed(bed), rng) {
            self.lay_rug(spot.shifted(0.0, 1.9), (bed + 1.0, 1.4));
            for side in [-1.0, 1.0] {
                self.stand(Piece::Nightstand, spot.shifted(side * (0.5 * bed + 0.28), 0.0));
            }
        }
        if bed < 1.2 {
            self.several(&[Piece::Desk, Piece::Bookshelf(0.9), Piece::Boxes], rng);
        }
        self.several(&[Piece::Wardrobe(1.65), Piece::Sideboard(1.2), Piece::Plant, Piece::Armchair], rng);
        if self.room.floor.area() > 15.0 {
            self.several(&[Piece::Desk, Piece::Bookshelf(0.9), Piece::FloorLamp, Piece::Wardrobe(1.1)], rng);
        }
    }

    fn bath(&mut self, rng: &mut ChaCha8Rng) {
        self.several(&[Piece::Bath, Piece::Toilet, Piece::Basin, Piece::Washer], rng);
        if self.room.floor.area() > 10.0 {
            self.several(&[Piece::Wardrobe(1.1), Piece::Boxes, Piece::Sideboard(1.2), Piece::Plant], rng);
        }
        self.lay_rug(Spot::new(self.room.floor.centre().0, self.room.floor.centre().1, 0), (0.9, 0.6));
    }

    fn study(&mut self, rng: &mut ChaCha8Rng) {
        self.several(&[Piece::Desk, Piece::Bookshelf(1.2), Piece::Bookshelf(1.2), Piece::Armchair], rng);
        self.several(&[Piece::Plant, Piece::FloorLamp, Piece::Sideboard(1.2)], rng);
        if self.room.floor.area() > 15.0 {
            self.several(&[Piece::Sofa(2), Piece::Bookshelf(1.2), Piece::Desk], rng);
        }
        self.lay_rug(Spot::new(self.room.floor.centre().0, self.room.floor.centre().1, 0), (2.0, 1.4));
    }

    fn dining(&mut self, rng: &mut ChaCha8Rng) {
        let (x, y) = self.room.floor.centre();
        self.lay_rug(Spot::new(x, y, 0), (2.6, 1.9));
        self.a_table(3, rng);
        self.several(&[Piece::Sideboard(1.6), Piece::Plant, Piece::Bookshelf(0.9), Piece::FloorLamp], rng);
        self.several(&[Piece::Sideboard(1.2), Piece::Armchair], rng);
    }

    fn storage(&mut self, rng: &mut ChaCha8Rng) {
        self.several(&[Piece::Wardrobe(1.1), Piece::Boxes, Piece::Bookshelf(0.9), Piece::Washer, Piece::Boxes], rng);
        self.several(&[Piece::Wardrobe(1.65), Piece::Sideboard(1.2), Piece::Bookshelf(1.2), Piece::Boxes], rng);
    }

    fn corridor(&mut self, rng: &mut ChaCha8Rng) {
        let n = if self.room.floor.area() > 9.0 { 4 } else { 2 };
        let stock = [Piece::ShoeCabinet, Piece::Plant, Piece::Bookshelf(0.9), Piece::ShoeCabinet];
        self.several(&stock[..n], rng);
        let (x, y) = self.room.floor.centre();
        let along_y = usize::from(self.room.floor.width() <= self.room.floor.depth());
        self.lay_rug(Spot::new(x, y, along_y), (2.2, 0.7));
    }

    /// The largest table that fits, with up to `chairs` along a side.
    fn a_table(&mut self, chairs: u32, rng: &mut ChaCha8Rng) {
        (1..=chairs).rev().find(|n| self.in_the_open(Piece::DiningSet(*n), rng).is_some());
    }

    /// A radiator below most windows that have nothing in front of them.
    fn radiators(&mut self, rng: &mut ChaCha8Rng) {
        for (k, side) in Side::ALL.into_iter().enumerate() {
            let windows: Vec<Span> = self.spans[k].iter().copied().filter(|s| s.height.0 > 0.7).collect();
            for window in windows {
                if rng.random_bool(0.8) {
                    self.at_wall(Piece::Radiator, side, 0.5 * (window.along.0 + window.along.1));
                }
            }
        }
    }

    fn several(&mut self, pieces: &[Piece], rng: &mut ChaCha8Rng) {
        for piece in pieces {
            self.against_a_wall(*piece, rng);
        }
    }

    /// Tries walls at random, corners more often than the middle.
    fn against_a_wall(&mut self, piece: Piece, rng: &mut ChaCha8Rng) -> Option<(Side, Spot)> {
        for _ in 0..TRIES {
            let side = Side::ALL[rng.random_range(0..4_u32) as usize];
            let slack = self.room.floor.side_length(side) - piece.size().0 - 0.04;
            if slack < 0.0 {
                continue;
            }
            let share = match rng.random_range(0..3_u32) {
                0 => 0.0,
                1 => 1.0,
                _ => rng.random_range(0.0..1.0),
            };
            let along = 0.02 + 0.5 * piece.size().0 + share * slack;
            if let Some(spot) = self.at_wall(piece, side, along) {
                return Some((side, spot));
            }
        }
        None
    }

    fn at_wall(&mut self, piece: Piece, side: Side, along: f64) -> Option<Spot> {
        let (width, _, height) = piece.size();
        let span = (along - 0.5 * width, along + 0.5 * width);
        let index = Side::ALL.iter().position(|s| *s == side)?;
        let hidden = |s: &Span| s.along.0 < span.1 && span.0 < s.along.1 && s.height.0 < height - 0.12;
        if self.spans[index].iter().any(hidden) {
            return None;
        }
        let spot = self.room.floor.side(side).shifted(along, 0.02);
        self.stand(piece, spot)?;
        self.spans[index].push(Span { along: span, height: (0.0, height + 0.1) });
        Some(spot)
    }

    /// Tries places away from the walls.
    fn in_the_open(&mut self, piece: Piece, rng: &mut ChaCha8Rng) -> Option<Spot> {
        let (_, depth, _) = piece.size();
        (0..TRIES).find_map(|_| {
            let inner = self.room.floor.grown(-0.9);
            let x = rng.random_range(inner.x0.min(inner.x1 - 0.1)..inner.x1.max(inner.x0 + 0.1));
            let y = rng.random_range(inner.y0.min(inner.y1 - 0.1)..inner.y1.max(inner.y0 + 0.1));
            let spot = Spot::new(x, y, rng.random_range(0..4_u32) as usize).shifted(0.0, -0.5 * depth);
            self.stand(piece, spot)
        })
    }

    /// Puts a piece there if nothing else is, and everybody can still pass.
    fn stand(&mut self, piece: Piece, spot: Spot) -> Option<Spot> {
        let (width, depth, _) = piece.size();
        let footprint = spot.rect((-0.5 * width, 0.5 * width), (0.0, depth));
        let free = self.room.floor.holds(&footprint.grown(-0.001))
            && !self.taken.iter().any(|t| t.overlaps(&footprint))
            && self.passable.admits(&footprint);
        if !free {
            return None;
        }
        self.passable.block(&footprint);
        self.taken.push(footprint.grown(0.02));
        self.placed.push(Placed { piece, spot });
        Some(spot)
    }

    fn lay_rug(&mut self, centre: Spot, size: (f64, f64)) {
        let (hx, hy) = (0.5 * size.0, 0.5 * size.1);
        if self.room.floor.grown(-0.05).holds(&centre.rect((-hx, hx), (-hy, hy))) {
            self.rugs.push((centre, size));
        }
    }
}
