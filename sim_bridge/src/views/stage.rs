//! A flat made ready for taking pictures: where a camera can be, what lies in its way, and what makes a picture worth
//! keeping.

use homing_core::{Camera, DepthImage, Intrinsics, RgbImage, Transform};

use super::{View, ViewsError};
use crate::arena::{Arena, BodySize, SceneRef};
use crate::flat::{self, Detail, Flat};
use crate::laser::LaserSlice;
use crate::scene::World;

/// Cameras keep this distance from everything, and nothing is above them up to this height.
const ROOM_FOR_CAMERA: BodySize = BodySize { radius_m: 0.2, height_m: 1.75 };
/// Lines of sight are judged at this height above the floor, metres: over most tables, below the tops of shelves.
const SIGHT_M: f64 = 1.1;
/// Pictures whose median depth is less show a wall from too near, metres.
const MEDIAN_M_MIN: f64 = 0.8;
/// Nearer than this is in the way, metres ...
const NEAR_M: f32 = 0.35;
/// ... of at most this share of a picture.
const NEAR_SHARE_MAX: f64 = 0.1;
/// Columns and rows of the blocks in which texture is looked for.
const BLOCKS: (usize, usize) = (16, 12);
/// Standard deviation of a block's luma from which it has texture, 8-bit codes.
const TEXTURE_SD_MIN: f64 = 6.0;
/// Share of blocks with texture that a picture must have.
const TEXTURE_SHARE_MIN: f64 = 0.4;

/// One state of a flat.
pub(super) struct Stage {
    arena: Arena,
    sight: LaserSlice,
    places: Vec<(f64, f64)>,
    variant: u32,
}

impl Stage {
    /// Generates the first `n` states of the flat of a seed.
    pub fn of_flat(seed: u64, n: u32) -> Result<Vec<Self>, ViewsError> {
        let states = flat::generate_states(seed, Detail::Full, n);
        states.into_iter().zip(0..n).map(|(flat, variant)| Self::new(flat, variant)).collect()
    }

    fn new(flat: Flat, variant: u32) -> Result<Self, ViewsError> {
        let rooms = flat.rooms.iter().map(|r| r.cell).collect();
        let arena = Arena::of_scene(SceneRef::Flat { seed: flat.seed }, flat.scene, rooms, ROOM_FOR_CAMERA)?;
        let sight = LaserSlice::new(arena.scene(), arena.grid().floor_z_m() + SIGHT_M);
        let (space, g) = (arena.space(), arena.space().geometry());
        let free = (0..g.len()).filter(|i| space.cells()[*i]);
        let places = free.map(|i| g.centre(i % g.width, i / g.width)).collect();
        Ok(Self { arena, sight, places, variant })
    }

    /// Where a camera can be, world frame (x, y), metres; never empty.
    pub fn places(&self) -> &[(f64, f64)] {
        &self.places
    }

    /// Height of the floor, world frame, metres.
    pub fn floor_z_m(&self) -> f64 {
        self.arena.grid().floor_z_m()
    }

    /// Metres to the first thing in a direction of the world frame, radians; `None` beyond `range_max_m`.
    pub fn range_m(&self, from: (f64, f64), direction_rad: f64, range_max_m: f64) -> Option<f64> {
        self.sight.range_m(from, direction_rad, range_max_m)
    }

    /// Takes a picture, or nothing if it would not be worth keeping.
    pub fn picture(&self, camera: Intrinsics, t_world_camera: Transform<World, Camera>) -> Option<View> {
        let (rgb, depth) = self.arena.view(&camera, &t_world_camera);
        let depth = in_millimetres(&depth)?;
        (is_open(&depth) && has_texture(&rgb)).then_some(View {
            camera,
            t_world_camera,
            rgb,
            depth,
            variant: self.variant,
        })
    }
}

/// Depth as a file with whole millimetres gives it back.
fn in_millimetres(depth: &DepthImage) -> Option<DepthImage> {
    let whole: Vec<u16> = depth.data().iter().map(|m| (m * 1e3 + 0.5) as u16).collect();
    DepthImage::from_millimetres(depth.width(), depth.height(), &whole).ok()
}

/// True if the view is neither of a wall from near nor blocked by something just before the lens.
fn is_open(depth: &DepthImage) -> bool {
    let mut known: Vec<f32> = depth.data().iter().copied().filter(|d| *d > 0.0).collect();
    if known.is_empty() {
        return false;
    }
    let near = known.iter().filter(|d| **d < NEAR_M).count() as f64 / known.len() as f64;
    let middle = known.len() / 2;
    let (_, median_m, _) = known.select_nth_unstable_by(middle, f32::total_cmp);
    f64::from(*median_m) >= MEDIAN_M_MIN && near <= NEAR_SHARE_MAX
}

/// True if enough blocks of the picture are not of one tone.
fn has_texture(rgb: &RgbImage) -> bool {
    let luma = rgb.to_luma();
    let (width, height) = (rgb.width() as usize, rgb.height() as usize);
    let textured = |column: usize, row: usize| {
        let columns = column * width / BLOCKS.0..(column + 1) * width / BLOCKS.0;
        let rows = row * height / BLOCKS.1..(row + 1) * height / BLOCKS.1;
        let (mut n, mut sum, mut squares) = (0.0, 0.0, 0.0);
        for value in rows.flat_map(|r| &luma[r * width + columns.start..r * width + columns.end]) {
            let value = f64::from(*value);
            (n, sum, squares) = (n + 1.0, sum + value, squares + value * value);
        }
        n > 0.0 && squares / n - (sum / n) * (sum / n) >= TEXTURE_SD_MIN * TEXTURE_SD_MIN
    };
    let blocks = (0..BLOCKS.1).flat_map(|row| (0..BLOCKS.0).map(move |column| (column, row)));
    let count = blocks.filter(|(column, row)| textured(*column, *row)).count();
    count as f64 >= TEXTURE_SHARE_MIN * (BLOCKS.0 * BLOCKS.1) as f64
}

#[cfg(test)]
mod tests {
    #![expect(clippy::unwrap_used, reason = "a test may fail by panicking")]
    use super::*;

    #[test]
    fn near_walls_and_even_pictures_are_not_worth_keeping() {
        let depth = |metres: f32| DepthImage::from_metres(64, 48, vec![metres; 64 * 48]).unwrap();
        assert!(is_open(&depth(2.0)) && !is_open(&depth(0.5)) && !is_open(&depth(0.0)));
        let mut blocked = vec![3.0; 64 * 48];
        blocked[..64 * 10].fill(0.2);
        assert!(!is_open(&DepthImage::from_metres(64, 48, blocked).unwrap()));
        let picture = |tone: &dyn Fn(usize) -> u8| {
            RgbImage::new(64, 48, (0..64 * 48).flat_map(|i| [tone(i); 3]).collect()).unwrap()
        };
        assert!(!has_texture(&picture(&|_| 90)));
        assert!(has_texture(&picture(&|i| if i % 2 == 0 { 80 } else { 120 })));
        // Texture in the upper quarter alone is not enough.
        assert!(!has_texture(&picture(&|i| if i < 64 * 12 && i % 2 == 0 { 80 } else { 120 })));
    }
}
