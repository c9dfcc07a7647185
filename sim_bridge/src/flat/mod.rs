//! Procedural flats: from a seed to rooms, doors, furniture and the scene they make.
//!
//! A flat is a rectangle of 9 to 13.5 m by 8 to 10.8 m, divided into 3 to 8 rooms by walls 0.12 m thick and 2.5 to 2.7 m
//! high. Its rooms choose their looks from one small stock, so that the same chair, poster or floor turns up in several of
//! them. Furniture leaves a way of at least 0.54 m between all doors of a room.

mod builder;
mod furnish;
mod furniture;
mod geometry;
mod layout;
pub mod mapped;
mod passable;
mod pen;
mod relight;
mod shell;
mod style;

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

pub use builder::Detail;
pub use geometry::{Rect, Side};
pub use layout::{Axis, Door, Room, RoomKind, WALL_M};

use crate::scene::Scene;
use builder::{SceneBuilder, Stock};
use furnish::{Furnishing, Span};
use layout::Plan;
use shell::Walls;
use style::{RoomStyle, Style, pick};

/// A generated flat.
#[derive(Clone, Debug, PartialEq)]
pub struct Flat {
    /// The seed it came from.
    pub seed: u64,
    /// Everything there is to see and to bump into.
    pub scene: Scene,
    /// 3 to 8 rooms.
    pub rooms: Vec<Room>,
    /// Doors and openings between them; every room can be reached.
    pub doors: Vec<Door>,
    /// From floor to ceiling, metres.
    pub height_m: f64,
}

impl Flat {
    /// Index of the room whose cell holds a point of the world frame, metres.
    #[must_use]
    pub fn room_at(&self, x_m: f64, y_m: f64) -> Option<usize> {
        self.rooms.iter().position(|r| r.cell.contains(x_m, y_m))
    }
}

/// Generates the flat of a seed: equal seeds give equal flats, bit for bit, on every machine.
#[must_use]
pub fn generate(seed: u64) -> Flat {
    generate_as(seed, Detail::Full)
}

/// Generates the flat of a seed in the detail asked for.
#[must_use]
pub fn generate_as(seed: u64, detail: Detail) -> Flat {
    generate_state(seed, detail, 0, &mut Stock::new())
}

/// Generates the flat of a seed in its first `n` states: the first is that of [`generate`], the others have the same
/// rooms, walls and pictures in other light, and some of their loose furniture elsewhere.
#[must_use]
pub fn generate_states(seed: u64, detail: Detail, n: u32) -> Vec<Flat> {
    let stock = &mut Stock::new();
    (0..n).map(|state| generate_state(seed, detail, state, stock)).collect()
}

fn generate_state(seed: u64, detail: Detail, state: u32, stock: &mut Stock) -> Flat {
    let rng = &mut ChaCha8Rng::seed_from_u64(seed);
    // Chance of its own, so that all that stays is drawn as in the flat as generated.
    let mut change = (state > 0).then(|| ChaCha8Rng::seed_from_u64(seed ^ (u64::from(state) << 40)));
    let plan = Plan::draw(rng);
    let height_m = rng.random_range(2.5..2.7);
    let walls = shell::plan_walls(&plan, height_m, rng);
    let style = Style::draw(rng);
    let scene = &mut SceneBuilder::default();
    for (room, walls) in plan.rooms.iter().zip(&walls) {
        build_room(scene, room, walls, &style, height_m, rng, change.as_mut());
    }
    let mut scene = core::mem::take(scene).finish(format!("flat seed {seed}"), detail, stock);
    if let Some(change) = &mut change {
        relight::relight(&mut scene, change);
    }
    Flat { seed, scene, rooms: plan.rooms, doors: plan.doors, height_m }
}

fn build_room(
    scene: &mut SceneBuilder,
    room: &Room,
    walls: &Walls,
    style: &Style,
    height_m: f64,
    rng: &mut ChaCha8Rng,
    change: Option<&mut ChaCha8Rng>,
) {
    let look = &style.room(room.kind, rng);
    let mut furnishing = Furnishing::new(room, walls);
    furnishing.furnish(rng);
    let spots = match change {
        Some(change) => furnishing.rearranged(walls, change),
        None => furnishing.placed.iter().map(|p| Some(p.spot)).collect(),
    };
    shell::build_room(scene, room, walls, style, look, height_m, rng);
    // A piece that is gone draws its chance all the same: the next ones look as they would beside it.
    let gone = &mut SceneBuilder::default();
    for (placed, spot) in furnishing.placed.iter().zip(spots) {
        let scene = if spot.is_some() { &mut *scene } else { &mut *gone };
        placed.piece.build(&mut scene.pen(spot.unwrap_or(placed.spot)), style, look, rng);
    }
    for (spot, size) in &furnishing.rugs {
        furniture::rug(&mut scene.pen(*spot), pick(&style.rugs, rng), *size);
    }
    hang_posters(scene, room, &furnishing.spans, style, look, rng);
}

/// Hangs posters where the wall is free at eye height.
fn hang_posters(
    scene: &mut SceneBuilder,
    room: &Room,
    spans: &[Vec<Span>; 4],
    style: &Style,
    look: &RoomStyle,
    rng: &mut ChaCha8Rng,
) {
    if room.kind == RoomKind::Bath {
        return;
    }
    for (k, side) in Side::ALL.into_iter().enumerate() {
        let length = room.floor.side_length(side);
        let mut hung: Vec<(f64, f64)> = Vec::new();
        for _ in 0..(length / 1.6) as u32 {
            let (width, height) = *pick(&[(0.5, 0.7), (0.7, 0.5), (0.7, 1.0), (0.4, 0.4)], rng);
            let from = rng.random_range(0.1..(length - width).max(0.2));
            let (x, z) = ((from, from + width), (1.55 - 0.5 * height, 1.55 + 0.5 * height));
            let hits = |s: &Span| {
                s.along.0 < x.1 + 0.1 && x.0 - 0.1 < s.along.1 && s.height.0 < z.1 + 0.05 && z.0 - 0.05 < s.height.1
            };
            let crowds = |h: &(f64, f64)| h.0 < x.1 + 0.2 && x.0 - 0.2 < h.1;
            let picture = pick(&style.posters, rng);
            if x.1 < length - 0.08 && !spans[k].iter().any(hits) && !hung.iter().any(crowds) && rng.random_bool(0.75) {
                furniture::poster(&mut scene.pen(room.floor.side(side)), picture, &look.wood, x, z);
                hung.push(x);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn equal_seeds_give_equal_flats_and_others_differ() {
        let (a, b, c) = (generate(7), generate(7), generate(8));
        assert_eq!(a, b);
        assert_ne!(a.scene.meshes, c.scene.meshes);
    }

    #[test]
    fn another_state_has_the_same_rooms_other_light_and_some_furniture_elsewhere() {
        let states = generate_states(7, Detail::Full, 3);
        let (a, b) = (&states[0], &states[1]);
        assert_eq!(*a, generate(7));
        assert_eq!((&a.rooms, &a.doors, a.height_m), (&b.rooms, &b.doors, b.height_m));
        assert_ne!(a.scene.lamps, b.scene.lamps);
        assert_ne!(b.scene.meshes, states[2].scene.meshes);
        let corners = |flat: &Flat| -> std::collections::BTreeSet<[u32; 3]> {
            flat.scene.meshes.iter().flat_map(|m| &m.vertices).map(|v| v.position.map(f32::to_bits)).collect()
        };
        let (before, after) = (corners(a), corners(b));
        let kept = before.intersection(&after).count() as f64 / before.len() as f64;
        assert!((0.3..0.95).contains(&kept), "{kept} of the corners stay");
    }

    #[test]
    fn a_flat_has_a_sensible_number_of_finite_triangles() {
        for seed in 0..20 {
            let scene = generate_as(seed, Detail::Shape).scene;
            let n: usize = scene.meshes.iter().map(|m| m.triangles.len()).sum();
            assert!((6_000..=40_000).contains(&n), "seed {seed}: {n} triangles");
            for mesh in &scene.meshes {
                assert!(mesh.material < scene.materials.len());
                assert!(mesh.triangles.iter().flatten().all(|i| (*i as usize) < mesh.vertices.len()));
                let finite =
                    |v: &crate::scene::Vertex| v.position.iter().chain(&v.normal).chain(&v.uv).all(|f| f.is_finite());
                assert!(mesh.vertices.iter().all(finite));
            }
        }
    }
}
