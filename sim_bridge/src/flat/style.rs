//! What the flat is made of: a small stock of looks from which the rooms choose, so that rooms resemble each other.

use rand::{Rng, RngExt};
use rand_chacha::ChaCha8Rng;

use super::builder::{Finish, Look};
use super::layout::RoomKind;
use crate::textures::Surface;

/// The stock of one flat.
#[derive(Clone, Debug)]
pub(super) struct Style {
    floors: Vec<Look>,
    wet_floor: Look,
    walls: Vec<Look>,
    wet_wall: Look,
    /// Ceilings.
    pub ceiling: Look,
    /// Door frames, skirting boards, window frames.
    pub trim: Look,
    /// Furniture wood, two kinds.
    pub woods: [Look; 2],
    /// Painted furniture.
    pub lacquer: Look,
    /// Upholstery, three kinds.
    pub fabrics: [Look; 3],
    /// Sheets, baths, basins.
    pub white: Look,
    /// Legs, taps, handles.
    pub metal: Look,
    /// Flower pots.
    pub clay: Look,
    /// Leaves.
    pub leaves: Look,
    /// Door leaves.
    pub door: Look,
    /// Books on a shelf.
    pub books: [Look; 2],
    /// Screens.
    pub screens: [Look; 2],
    /// Fronts of fridge, oven, cupboards.
    pub appliances: [Look; 3],
    /// Daylight.
    pub windows: [Look; 2],
    /// Posters, fewer than there are places for them.
    pub posters: Vec<Look>,
    /// Rugs.
    pub rugs: [Look; 2],
    /// Lamp shades.
    pub glow: Look,
}

/// What one room takes from the stock.
#[derive(Copy, Clone, Debug)]
pub(super) struct RoomStyle {
    /// Floor.
    pub floor: Look,
    /// Walls.
    pub wall: Look,
    /// Most of its furniture.
    pub wood: Look,
    /// Its main fabric.
    pub fabric: Look,
    /// Its second fabric.
    pub accent: Look,
}

impl Style {
    /// Draws a stock.
    pub fn draw(rng: &mut ChaCha8Rng) -> Self {
        let mut of = |surface: Surface| Look::of(surface, rng.next_u64());
        let floors = vec![of(Surface::WoodFloor), of(Surface::Parquet)];
        let walls = vec![of(Surface::Plaster), of(Surface::Wallpaper), of(Surface::Plaster), of(Surface::Brick)];
        let plaster = of(Surface::Plaster);
        Self {
            floors,
            walls,
            wet_floor: of(Surface::Tile),
            wet_wall: of(Surface::Tile),
            ceiling: plaster.tinted([0.95, 0.94, 0.92]),
            trim: Look::plain([0.82, 0.81, 0.78]),
            woods: [of(Surface::WoodGrain), of(Surface::WoodGrain)],
            lacquer: plaster.tinted([0.85, 0.86, 0.84]),
            fabrics: [of(Surface::Fabric), of(Surface::Fabric), of(Surface::Fabric)],
            white: Look::plain([0.86, 0.87, 0.88]),
            metal: Look::plain([0.35, 0.36, 0.38]),
            clay: Look::plain([0.45, 0.2, 0.11]),
            leaves: of(Surface::Leaves).finished(Finish::TwoSided),
            door: of(Surface::Door),
            books: [of(Surface::Books), of(Surface::Books)],
            screens: [of(Surface::Screen), of(Surface::Screen)].map(|l| l.finished(Finish::Glowing)),
            appliances: [of(Surface::Appliance), of(Surface::Appliance), of(Surface::Appliance)],
            windows: [of(Surface::Window), of(Surface::Window)].map(|l| l.finished(Finish::Glowing)),
            posters: (0..4).map(|_| of(Surface::Poster)).collect(),
            rugs: [of(Surface::Rug), of(Surface::Rug)],
            glow: Look::plain([1.0, 0.95, 0.85]).finished(Finish::Glowing),
        }
    }

    /// What a room of that kind looks like. Rooms share looks on purpose.
    pub fn room(&self, kind: RoomKind, rng: &mut ChaCha8Rng) -> RoomStyle {
        let wet = kind == RoomKind::Bath || (kind == RoomKind::Kitchen && rng.random_bool(0.6));
        let floor = if wet { self.wet_floor } else { *pick(&self.floors, rng) };
        let n = if kind == RoomKind::Corridor { 3 } else { self.walls.len() };
        let wall = if kind == RoomKind::Bath { self.wet_wall } else { *pick(&self.walls[..n], rng) };
        let first = rng.random_range(0..3_u32) as usize;
        RoomStyle {
            floor,
            wall,
            wood: *pick(&self.woods, rng),
            fabric: self.fabrics[first],
            accent: self.fabrics[(first + 1) % 3],
        }
    }
}

/// One element of a list that is not empty.
pub(super) fn pick<'a, T>(list: &'a [T], rng: &mut ChaCha8Rng) -> &'a T {
    &list[rng.random_range(0..list.len() as u32) as usize]
}
