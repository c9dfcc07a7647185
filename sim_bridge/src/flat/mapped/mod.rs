//! A scene from a navigability map: real rooms and real ways, with our own walls and furniture.
//!
//! The published benchmarks give maps of where an agent can be, not what there is to see. Walls are raised around the
//! map a little outside its border, what stands in the open becomes furniture, and every room gets floor, wall and
//! pictures of its own. The scene is a function of the map alone: equal maps give equal scenes, bit for bit, on every
//! machine.

mod contour;
mod dress;
mod islands;
mod map;
mod regions;
mod stretches;
mod widen;

use core::cell::Cell;

use rand::{Rng, RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

pub use map::{MapError, NavMap};

use super::builder::{Detail, Look, SceneBuilder, Stock};
use super::furniture;
use super::geometry::{Rect, Spot};
use super::layout::RoomKind;
use super::shell::{Facing, slab};
use super::style::{Style, pick};
use crate::scene::{Lamp, Scene};
use crate::textures::Surface;
use contour::Point;
use dress::RoomLook;
use regions::Regions;
use widen::Floor;

/// Radius of the agents that the published maps were made for, metres: Habitat's default. Who measures on a map uses a
/// body of this size, for a wider one does not pass the narrow ways of the published tasks.
pub const AGENT_RADIUS_M: f64 = 0.1;
/// Height of those agents, metres (Habitat's default).
pub const AGENT_HEIGHT_M: f64 = 1.5;
/// Walls are straightened by at most this, metres: less than what the floor is wider than the agent's radius.
const STRAIGHTENED_M: f64 = 0.08;
/// Rooms with a stock of looks of their own; further rooms share them.
const STYLES_MAX: usize = 8;
/// Pictures in a room's stock.
const POSTERS: usize = 14;
/// Share of rooms whose walls may be plain plaster.
const PLAIN_SHARE: f64 = 0.2;
/// Floor for which one lamp is enough, square metres.
const LAMP_M2: f64 = 11.0;
/// A map with more outlines than this is noise, not rooms: every one would become a wall or a piece of furniture.
const OUTLINES_MAX: usize = 3000;
/// Single closed pixels stand in nobody's way: a post this near to where an agent's centre can be would. Metres.
const POST_CLEAR_M: f64 = AGENT_RADIUS_M + 0.075;
/// Pieces of floor overlap by this, metres, so that no crack shows between them.
const OVERLAP_M: f64 = 0.002;

/// Builds the scene of a map. The floor is at z = 0; x and y are Habitat's x and -z (see [`crate::habitat::axes`]).
///
/// # Errors
/// [`MapError::Ragged`] for a map of specks.
pub fn build(map: &NavMap, detail: Detail) -> Result<Scene, MapError> {
    let rng = &mut ChaCha8Rng::seed_from_u64(map.seed());
    let height_m = rng.random_range(2.5..2.7);
    let regions = Regions::of(map);
    // A pixel is navigable if its centre is: the floor goes on for half a pixel more on average, then for the radius.
    let floor = Floor::of(map, AGENT_RADIUS_M + 0.5 * map.geometry.resolution_m);
    let looks: Vec<RoomLook> = (0..regions.rooms.len().clamp(1, STYLES_MAX)).map(|_| room_look(rng)).collect();
    let look_of = |room: u32| &looks[room as usize % looks.len()];
    let scene = &mut SceneBuilder::default();
    floors(scene, &regions, &looks, height_m);
    let outlines = contour::outlines(&floor, STRAIGHTENED_M);
    if outlines.len() > OUTLINES_MAX {
        return Err(MapError::Ragged { name: map.name.clone(), found: outlines.len(), allowed: OUTLINES_MAX });
    }
    for corners in outlines {
        let area = contour::signed_area(&corners);
        if area.abs() < islands::POST_M2_MAX && (area > 0.0 || regions.is_navigable_near(corners[0], POST_CLEAR_M)) {
            continue;
        }
        if area < 0.0 && islands::is_furniture(&corners) {
            islands::block(scene, &corners, look_of(room_around(&corners, &regions)), rng);
            continue;
        }
        for stretch in stretches::stretches(&corners, &regions) {
            dress::wall(scene, &stretch, look_of(stretch.room), height_m, rng);
        }
    }
    for room in 0..regions.rooms.len() as u32 {
        lamps_and_rug(scene, &regions, room, look_of(room), height_m, rng);
    }
    Ok(core::mem::take(scene).finish(format!("layout {}", map.name), detail, &mut Stock::new()))
}

/// Looks of one room, from a stock of its own.
fn room_look(rng: &mut ChaCha8Rng) -> RoomLook {
    use RoomKind::{Bath, Bedroom, Child, Corridor, Dining, Kitchen, Living, Study};
    let mut style = Style::draw(rng);
    style.posters = (0..POSTERS).map(|_| Look::of(Surface::Poster, rng.next_u64())).collect();
    let kinds = [Living, Kitchen, Bedroom, Study, Dining, Child, Living, Study, Corridor, Bath];
    let mut look = style.room(*pick(&kinds, rng), rng);
    if !rng.random_bool(PLAIN_SHARE) {
        let bold = [Surface::Wallpaper, Surface::Wallpaper, Surface::Brick, Surface::Tile, Surface::WoodFloor];
        look.wall = Look::of(*pick(&bold, rng), rng.next_u64());
    }
    let other = style.room(*pick(&[Living, Study], rng), rng).wall;
    let accent = if other == look.wall { Look::of(Surface::Wallpaper, rng.next_u64()) } else { other };
    RoomLook { style, look, accent, hung: Cell::new(0) }
}

fn room_around(corners: &[Point], regions: &Regions) -> u32 {
    corners.iter().find_map(|c| regions.at(*c)).unwrap_or(0)
}

/// Floor and ceiling under and over everything up to a little beyond the walls, as few large rectangles.
fn floors(scene: &mut SceneBuilder, regions: &Regions, looks: &[RoomLook], height_m: f64) {
    let g = &regions.geometry;
    for (room, columns, rows) in rectangles(&regions.of_cell, g.width) {
        let x = |column: usize| g.origin_x_m + column as f64 * g.resolution_m;
        let y = |row: usize| g.origin_y_m + row as f64 * g.resolution_m;
        let area = Rect::new(x(columns.0), y(rows.0), x(columns.1), y(rows.1)).grown(OVERLAP_M);
        let look = &looks[room as usize % looks.len()];
        let pen = &mut scene.pen(Spot::new(0.0, 0.0, 0));
        slab(pen, &look.look.floor, &area, 0.0, Facing::Up);
        slab(pen, &look.style.ceiling, &area, height_m, Facing::Down);
    }
}

/// A room, its first column and the one after its last, its first row and the one after its last.
type Block = (u32, (usize, usize), (usize, usize));

/// Covers the cells of every room with rectangles: runs along rows, joined with equal ones above them.
fn rectangles(of_cell: &[Option<u32>], width: usize) -> Vec<Block> {
    let mut done: Vec<Block> = Vec::new();
    let mut open: Vec<Block> = Vec::new();
    for (row, cells) in of_cell.chunks(width).enumerate() {
        let mut next = Vec::new();
        let mut column = 0;
        while column < width {
            let from = column;
            while column < width && cells[column] == cells[from] {
                column += 1;
            }
            let Some(room) = cells[from] else { continue };
            let above = open.iter().position(|b| b.0 == room && b.1 == (from, column));
            let first = above.map_or(row, |k| open.swap_remove(k).2.0);
            next.push((room, (from, column), (first, row + 1)));
        }
        done.append(&mut open);
        open = next;
    }
    done.append(&mut open);
    done
}

/// Lamps under the ceiling where the room is wide, and a rug where it is widest.
fn lamps_and_rug(
    scene: &mut SceneBuilder,
    regions: &Regions,
    room: u32,
    look: &RoomLook,
    height_m: f64,
    rng: &mut ChaCha8Rng,
) {
    let region = &regions.rooms[room as usize];
    let n = (region.area_m2 / LAMP_M2).ceil() as usize;
    let warm = rng.random_range(0.75..0.95_f32);
    for (x, y) in regions.places(room, n, 0.5 * region.radius_m) {
        let pen = &mut scene.pen(Spot::new(x, y, 0));
        let low = height_m - 0.22;
        let shade = [(0.0, low), (0.16, low), (0.19, low + 0.1), (0.03, low + 0.14)];
        pen.ghost().turned(&look.style.glow, (0.0, 0.0), &shade, 14);
        pen.ghost().post(&look.style.metal, (0.0, 0.0), 0.012, (low + 0.12, height_m));
        let colour = [1.0, 0.5 + 0.5 * warm, warm];
        scene.lamps.push(Lamp { position: [x as f32, y as f32, (low - 0.12) as f32], colour, reach_m: 7.0 });
    }
    let half = 0.6 * region.radius_m;
    if half > 0.45 {
        let long = half.min(1.2);
        let spot = Spot::new(region.middle.0, region.middle.1, rng.random_range(0..2_u32) as usize);
        furniture::rug(&mut scene.pen(spot), pick(&look.style.rugs, rng), (2.0 * long, 1.4 * long));
    }
}

#[cfg(test)]
mod tests;
