//! An invented flat of boxes, seen by casting rays.

use std::sync::Arc;

use homing_core::{Cell, DepthImage, GridGeometry, Intrinsics, OccupancyGrid, PlanarPose, RgbImage, RgbdFrame, Stamp};
use nalgebra::Point3;

const CAMERA_HEIGHT_M: f64 = 0.9;
const CEILING_M: f64 = 2.5;

/// Low and high corner (metres), height (metres), colour.
type Block = ([f64; 4], f64, [f64; 3]);

const WALL: [f64; 3] = [214.0, 206.0, 190.0];
const BLOCKS: [Block; 23] = [
    ([-0.1, -0.1, 11.1, 0.0], CEILING_M, WALL),
    ([-0.1, 9.0, 11.1, 9.1], CEILING_M, WALL),
    ([-0.1, 0.0, 0.0, 9.0], CEILING_M, WALL),
    ([11.0, 0.0, 11.1, 9.0], CEILING_M, WALL),
    ([0.0, 3.0, 4.0, 3.1], CEILING_M, [196.0, 208.0, 214.0]),
    ([5.2, 3.0, 11.0, 3.1], CEILING_M, [196.0, 208.0, 214.0]),
    ([5.6, 0.0, 5.7, 3.0], CEILING_M, [222.0, 200.0, 178.0]),
    ([0.0, 5.6, 3.2, 5.7], CEILING_M, [210.0, 214.0, 196.0]),
    ([4.2, 5.6, 7.0, 5.7], CEILING_M, [210.0, 214.0, 196.0]),
    ([8.2, 5.6, 11.0, 5.7], CEILING_M, [224.0, 206.0, 206.0]),
    ([6.0, 5.7, 6.1, 9.0], CEILING_M, [204.0, 200.0, 220.0]),
    ([0.3, 0.2, 1.1, 0.9], 0.8, [132.0, 88.0, 56.0]),
    ([2.4, 0.0, 3.2, 0.4], 1.8, [88.0, 62.0, 48.0]),
    ([0.0, 3.5, 0.6, 5.0], 0.7, [70.0, 104.0, 140.0]),
    ([2.6, 5.1, 3.6, 5.5], 1.1, [150.0, 118.0, 70.0]),
    ([8.6, 3.2, 10.4, 3.9], 0.75, [128.0, 60.0, 62.0]),
    ([10.4, 5.8, 10.9, 7.0], 1.9, [96.0, 72.0, 52.0]),
    ([8.2, 8.2, 9.8, 8.9], 0.6, [64.0, 92.0, 84.0]),
    ([6.3, 8.1, 6.8, 8.8], 1.2, [160.0, 126.0, 66.0]),
    ([1.2, 7.0, 2.8, 8.2], 0.75, [120.0, 96.0, 76.0]),
    ([7.6, 0.4, 9.0, 1.6], 0.75, [110.0, 84.0, 60.0]),
    ([10.4, 7.9, 10.9, 8.9], 0.9, [176.0, 140.0, 90.0]),
    ([4.6, 8.5, 5.6, 8.9], 1.6, [84.0, 92.0, 120.0]),
];

/// The flat, and what has been seen of it.
pub struct Flat {
    seen: OccupancyGrid,
}

struct Hit {
    distance_m: f64,
    along_m: f64,
    block: usize,
    side: bool,
}

impl Flat {
    pub fn new() -> Self {
        let geometry = GridGeometry { width: 240, height: 200, resolution_m: 0.05, origin_x_m: -0.5, origin_y_m: -0.5 };
        Self { seen: OccupancyGrid::unknown(geometry) }
    }

    /// Colour and depth from a pose.
    pub fn look(
        &self,
        pose: &PlanarPose,
        camera: Intrinsics,
        stamp: Stamp,
    ) -> Result<RgbdFrame, Box<dyn std::error::Error>> {
        let (width, height) = (camera.width() as usize, camera.height() as usize);
        let mut rgb = vec![0; 3 * width * height];
        let mut depth = vec![0.0; width * height];
        for column in 0..width {
            let ray = camera.unproject(column as f64, 0.0, 1.0);
            let (dx, dy) = rotate(pose.yaw_rad, 1.0, -ray.x);
            let hits = hits_along(pose, dx, dy);
            for row in 0..height {
                let fall = camera.unproject(0.0, row as f64, 1.0).y;
                let (metres, colour) = shade(pose, (dx, dy), fall, &hits);
                depth[row * width + column] = metres as f32;
                rgb[3 * (row * width + column)..][..3].copy_from_slice(&colour);
            }
        }
        let rgb = Arc::new(RgbImage::new(camera.width(), camera.height(), rgb)?);
        let depth = Arc::new(DepthImage::from_metres(camera.width(), camera.height(), depth)?);
        Ok(RgbdFrame::new(stamp, rgb, depth, camera)?)
    }

    /// Marks what is visible from a pose.
    pub fn explore(&mut self, pose: &PlanarPose) {
        for i in -200..=200 {
            let (dx, dy) = rotate(pose.yaw_rad + f64::from(i) * 0.005, 1.0, 0.0);
            let reach_m = hits_along(pose, dx, dy).first().map_or(5.0, |hit| hit.distance_m);
            let free_m = reach_m.min(5.0);
            for k in 0..(free_m / 0.03) as usize {
                self.mark(pose.x_m + 0.03 * k as f64 * dx, pose.y_m + 0.03 * k as f64 * dy, Cell::Free);
            }
            if reach_m < 5.0 {
                self.mark(pose.x_m + (reach_m + 0.02) * dx, pose.y_m + (reach_m + 0.02) * dy, Cell::Occupied);
            }
        }
    }

    /// The map as a robot that started at `start` has it.
    pub fn map_in_odom(&self, start: &PlanarPose) -> OccupancyGrid {
        let mut map = OccupancyGrid::unknown(GridGeometry::centred(24.0, 0.05));
        for row in 0..map.geometry.height {
            for column in 0..map.geometry.width {
                let (x, y) = map.geometry.centre(column, row);
                let (fx, fy) = rotate(start.yaw_rad, x, y);
                if let Some((c, r)) = self.seen.geometry.cell_at(start.x_m + fx, start.y_m + fy) {
                    let index = map.geometry.index(column, row);
                    map.cells[index] = self.seen.at(c, r);
                }
            }
        }
        map
    }

    fn mark(&mut self, x_m: f64, y_m: f64, cell: Cell) {
        if let Some((c, r)) = self.seen.geometry.cell_at(x_m, y_m) {
            let index = self.seen.geometry.index(c, r);
            if self.seen.cells[index] != Cell::Occupied {
                self.seen.cells[index] = cell;
            }
        }
    }
}

/// A point of the flat in the frame that begins where the robot did.
pub fn in_odom(start: &PlanarPose, x_m: f64, y_m: f64) -> (f64, f64) {
    rotate(-start.yaw_rad, x_m - start.x_m, y_m - start.y_m)
}

/// A camera point on the floor plan, with its height.
pub fn to_floor(pose: &PlanarPose, p_camera: &Point3<f64>) -> (f64, f64, f64) {
    let (dx, dy) = rotate(pose.yaw_rad, p_camera.z, -p_camera.x);
    (pose.x_m + dx, pose.y_m + dy, CAMERA_HEIGHT_M - p_camera.y)
}

/// A point of the flat in a camera's frame.
pub fn to_camera(pose: &PlanarPose, x_m: f64, y_m: f64, z_m: f64) -> Point3<f64> {
    let (forward, left) = rotate(-pose.yaw_rad, x_m - pose.x_m, y_m - pose.y_m);
    Point3::new(-left, CAMERA_HEIGHT_M - z_m, forward)
}

fn rotate(angle: f64, x: f64, y: f64) -> (f64, f64) {
    (x * angle.cos() - y * angle.sin(), x * angle.sin() + y * angle.cos())
}

/// Entries into blocks along a ray, nearest first.
fn hits_along(pose: &PlanarPose, dx: f64, dy: f64) -> Vec<Hit> {
    let slab = |low: f64, high: f64, at: f64, d: f64| {
        let (a, b) = ((low - at) / d, (high - at) / d);
        (a.min(b), a.max(b))
    };
    let mut hits: Vec<Hit> = BLOCKS
        .iter()
        .enumerate()
        .filter_map(|(block, ([x0, y0, x1, y1], ..))| {
            let (x_in, x_out) = slab(*x0, *x1, pose.x_m, dx);
            let (y_in, y_out) = slab(*y0, *y1, pose.y_m, dy);
            let distance_m = x_in.max(y_in);
            let side = x_in > y_in;
            let along_m = if side { pose.y_m + distance_m * dy } else { pose.x_m + distance_m * dx };
            (distance_m > 0.0 && distance_m < x_out.min(y_out)).then_some(Hit { distance_m, along_m, block, side })
        })
        .collect();
    hits.sort_by(|a, b| a.distance_m.total_cmp(&b.distance_m));
    hits
}

/// Depth and colour of what a ray that falls `fall` metres per metre meets.
fn shade(pose: &PlanarPose, (dx, dy): (f64, f64), fall: f64, hits: &[Hit]) -> (f64, [u8; 3]) {
    let floor_m = if fall > 0.0 { CAMERA_HEIGHT_M / fall } else { (CAMERA_HEIGHT_M - CEILING_M) / fall.min(-1e-9) };
    for hit in hits.iter().filter(|hit| hit.distance_m < floor_m) {
        let (_, height_m, colour) = BLOCKS[hit.block];
        let z = CAMERA_HEIGHT_M - fall * hit.distance_m;
        if z < height_m {
            return (hit.distance_m, lit(paint(hit, z, height_m, colour), hit.distance_m, hit.side));
        }
    }
    let (x, y) = (pose.x_m + floor_m * dx, pose.y_m + floor_m * dy);
    if fall <= 0.0 {
        return (floor_m, lit([236.0, 236.0, 232.0], floor_m, false));
    }
    let plank = noise((x * 6.0).floor() as i64, (y * 0.9 + (x * 6.0).floor() * 0.37).floor() as i64);
    (floor_m, lit([168.0 + 34.0 * plank, 128.0 + 26.0 * plank, 86.0 + 18.0 * plank], floor_m, false))
}

/// Texture of a wall or a piece of furniture: posters, shelves, grain.
fn paint(hit: &Hit, z: f64, height_m: f64, colour: [f64; 3]) -> [f64; 3] {
    let panel = (hit.along_m / 1.3).floor() as i64;
    let (u, v) = (hit.along_m / 1.3 - panel as f64, z);
    let grain = 6.0 * noise((hit.along_m * 90.0) as i64, (z * 90.0) as i64);
    let is_wall = height_m == CEILING_M;
    let has_poster = is_wall && noise(panel, hit.block as i64) > 0.35;
    if has_poster && (0.2..0.75).contains(&u) && (1.0..1.8).contains(&v) {
        let (a, b) = ((u * 14.0) as i64, (v * 11.0) as i64);
        let seed = panel * 31 + hit.block as i64 * 7;
        return [0, 1, 2].map(|c| 40.0 + 200.0 * noise(a + seed, b * 3 + c));
    }
    let shelf = if is_wall { 0.0 } else { -38.0 * f64::from(u8::from((z * 3.4).fract() < 0.12)) };
    let skirting = if is_wall && z < 0.09 { -60.0 } else { 0.0 };
    colour.map(|c| c + grain + shelf + skirting)
}

fn lit(colour: [f64; 3], distance_m: f64, side: bool) -> [u8; 3] {
    let light = (1.06 - 0.055 * distance_m).max(0.45) * if side { 0.88 } else { 1.0 };
    colour.map(|c| (c * light).clamp(0.0, 255.0) as u8)
}

/// A number from 0 to 1 that looks random.
fn noise(a: i64, b: i64) -> f64 {
    let mut h = (a.wrapping_mul(0x9E37_79B9) ^ b.wrapping_mul(0x85EB_CA6B)) as u64;
    h = (h ^ (h >> 31)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
    h = (h ^ (h >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
    ((h >> 40) & 0xFFFF) as f64 / 65_535.0
}
