//! What stands in the open: closed parts of a map with navigable floor all around them become blocks as high as
//! furniture.

use rand::RngExt;
use rand_chacha::ChaCha8Rng;

use super::super::builder::{Contact, Look, SceneBuilder, push_fan};
use super::super::geometry::Spot;
use super::super::pen::{Mapping, Pen};
use super::super::style::pick;
use super::contour::{Point, distance, signed_area, triangulated};
use super::dress::RoomLook;
use crate::scene::Vertex;

/// Islands up to this size are furniture, square metres ...
const FURNITURE_M2_MAX: f64 = 5.0;
/// ... if they are no longer than this, metres ...
const FURNITURE_M_MAX: f64 = 3.5;
/// ... and not both as thin as a wall and as long as one, metres.
const WALL_THIN_M: f64 = 0.18;
const WALL_LONG_M: f64 = 1.2;
/// What is smaller than this is a post, square metres.
pub(super) const POST_M2_MAX: f64 = 0.012;
/// Half the side of a post, metres: what widening the floor left of it may be less than a chair's leg.
const POST_HALF_M: f64 = 0.035;

/// True if the outline of what stands in a floor (clockwise) is that of furniture rather than of walls.
pub(super) fn is_furniture(corners: &[Point]) -> bool {
    let area = signed_area(corners).abs();
    let next = corners.iter().cycle().skip(1);
    let around: f64 = corners.iter().zip(next).map(|(a, b)| distance(*a, *b)).sum();
    let (length, thickness) = (0.5 * around, 2.0 * area / around.max(1e-9));
    area <= FURNITURE_M2_MAX && length <= FURNITURE_M_MAX && !(thickness < WALL_THIN_M && length > WALL_LONG_M)
}

/// Draws a block with an outline (clockwise, as the floor has it).
pub(super) fn block(scene: &mut SceneBuilder, corners: &[Point], room: &RoomLook, rng: &mut ChaCha8Rng) {
    let area = signed_area(corners).abs();
    if area < POST_M2_MAX {
        return post(scene, corners, room, rng);
    }
    let heights: &[f64] = match area {
        a if a < 0.35 => &[0.45, 0.75, 1.1, 1.9],
        a if a < 1.5 => &[0.75, 0.9, 1.2, 2.0],
        _ => &[0.42, 0.75, 0.9],
    };
    let height = *pick(heights, rng) + rng.random_range(-0.04..0.04);
    let body = *pick(&[room.look.wood, room.style.lacquer, room.look.fabric, room.style.woods[1]], rng);
    let top = if rng.random_bool(0.5) { body } else { room.look.wood };
    let kind = rng.random_range(0..3_u32);
    for (k, &from) in corners.iter().enumerate() {
        let to = corners[(k + 1) % corners.len()];
        let length = distance(from, to);
        let yaw = libm::atan2(to.1 - from.1, to.0 - from.0);
        let pen = &mut scene.pen(Spot::new(from.0, from.1, 0).turned(yaw));
        let face = [[length, 0.0, -0.01], [0.0, 0.0, -0.01], [0.0, 0.0, height], [length, 0.0, height]];
        pen.face(&body, face, Mapping::Metres(0.7 * from.0, 0.3 * from.1));
        if length > 0.3 {
            front(&mut pen.ghost(), length, height, kind, room, rng);
        }
        pen.ghost().cuboid(&top, [-0.01, -0.02, height - 0.03], [length + 0.01, 0.012, height + 0.003]);
    }
    lid(scene, corners, height, &top);
}

/// Doors, drawers or books before one side of a block.
fn front(pen: &mut Pen<'_>, length: f64, height: f64, kind: u32, room: &RoomLook, rng: &mut ChaCha8Rng) {
    let (style, top) = (&room.style, height - 0.05);
    match kind {
        0 => {
            let rows = (top / 0.36).floor().max(1.0);
            for k in 0..rows as u32 {
                let z = top * f64::from(k) / rows;
                let books = pick(&style.books, rng);
                pen.front(books, (0.03, length - 0.03), 0.006, (z + 0.04, z + 0.92 * top / rows));
            }
        }
        1 => {
            let n = (length / 0.5).round().max(1.0);
            for k in 0..n as u32 {
                let (x0, x1) = (length / n * f64::from(k) + 0.01, length / n * f64::from(k + 1) - 0.01);
                pen.front(pick(&style.appliances, rng), (x0, x1), 0.006, (0.06, top));
            }
        }
        _ => {
            let rows = (top / 0.24).floor().max(1.0);
            for k in 0..rows as u32 {
                let (z0, z1) = (top * f64::from(k) / rows + 0.015, top * f64::from(k + 1) / rows - 0.01);
                pen.cuboid(&room.look.wood, [0.015, 0.0, z0], [length - 0.015, 0.012, z1]);
                let (middle, z) = (0.5 * length, 0.5 * (z0 + z1));
                pen.cuboid(&style.metal, [middle - 0.07, 0.012, z - 0.008], [middle + 0.07, 0.026, z + 0.008]);
            }
        }
    }
}

fn lid(scene: &mut SceneBuilder, corners: &[Point], height: f64, look: &Look) {
    let side = look.side_m().unwrap_or(1.0);
    let around: Vec<Point> = corners.iter().rev().copied().collect();
    let mesh = scene.mesh(look, Contact::Solid);
    for triangle in triangulated(&around) {
        push_fan(
            mesh,
            &triangle.map(|(x, y)| Vertex {
                position: [x as f32, y as f32, height as f32],
                normal: [0.0, 0.0, 1.0],
                uv: [(x / side) as f32, (y / side) as f32],
            }),
        );
    }
}

fn post(scene: &mut SceneBuilder, corners: &[Point], room: &RoomLook, rng: &mut ChaCha8Rng) {
    let n = corners.len() as f64;
    let (x, y) = corners.iter().fold((0.0, 0.0), |s, c| (s.0 + c.0 / n, s.1 + c.1 / n));
    let height = rng.random_range(0.8..1.7);
    let (low, high) = ([-POST_HALF_M, -POST_HALF_M, 0.0], [POST_HALF_M, POST_HALF_M, height]);
    let pen = &mut scene.pen(Spot::new(x, y, 0));
    pen.cuboid(&room.look.wood, low, high);
    pen.ghost().turned(&room.style.clay, (0.0, 0.0), &[(0.04, height), (0.1, height + 0.14), (0.0, height + 0.15)], 12);
}

#[cfg(test)]
mod tests {
    use super::*;

    fn rectangle(width: f64, depth: f64) -> Vec<Point> {
        vec![(0.0, 0.0), (0.0, depth), (width, depth), (width, 0.0)]
    }

    #[test]
    fn tables_are_furniture_and_partitions_are_walls() {
        assert!(is_furniture(&rectangle(1.6, 0.9)));
        assert!(is_furniture(&rectangle(0.1, 0.1)));
        assert!(!is_furniture(&rectangle(2.5, 0.12)), "a partition");
        assert!(!is_furniture(&rectangle(3.0, 2.5)), "a core with a bath in it");
    }
}
