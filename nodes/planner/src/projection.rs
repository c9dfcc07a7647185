//! Where each pixel of a depth image points, seen from above: computed once per camera, used every frame.

use homing_core::{Base, Camera, Intrinsics, Transform};

/// Every fourth row is enough: at 6 m and 120 degrees of view two such rows are 13 cm apart on a wall.
const ROW_STRIDE: u32 = 4;

/// One sampled pixel.
#[derive(Copy, Clone, Debug)]
pub struct PixelRay {
    /// Index of the pixel in the depth image.
    pub pixel: u32,
    /// Azimuth sector in the base frame.
    pub sector: u32,
    /// Distance on the floor per metre of depth.
    pub reach: f32,
    /// Rise per metre of depth.
    pub rise: f32,
}

/// The sampled pixels of one camera, by azimuth sector.
#[derive(Clone, Debug)]
pub struct Projection {
    intrinsics: Intrinsics,
    t_base_camera: Transform<Base, Camera>,
    /// Sampled pixels, row-major.
    pub rays: Vec<PixelRay>,
    /// Sectors in a full turn; sector 0 begins at azimuth -pi.
    pub n_sectors: usize,
    /// Nearest floor that a sector's pixels can see, metres from the camera; infinite if it sees none.
    pub floor_from_m: Vec<f32>,
    /// Camera position in the base frame, metres.
    pub camera_m: [f32; 3],
}

impl Projection {
    /// The table for one camera.
    pub fn new(intrinsics: &Intrinsics, t_base_camera: &Transform<Base, Camera>) -> Self {
        let pixel_rad = libm::atan(1.0 / intrinsics.fx());
        let n_sectors = (core::f64::consts::TAU / (1.12 * pixel_rad)).clamp(64.0, 1024.0) as usize;
        let p = t_base_camera.translation();
        let mut floor_from_m = vec![f32::INFINITY; n_sectors];
        let mut rays = Vec::new();
        let rotation = t_base_camera.rotation().to_rotation_matrix();
        for row in (ROW_STRIDE / 2..intrinsics.height()).step_by(ROW_STRIDE as usize) {
            for column in 0..intrinsics.width() {
                let ray = rotation * intrinsics.unproject(f64::from(column), f64::from(row), 1.0).coords;
                let sector = sector_of(libm::atan2f(ray.y as f32, ray.x as f32), n_sectors);
                let (reach, rise) = ((ray.x * ray.x + ray.y * ray.y).sqrt() as f32, ray.z as f32);
                if rise < -1e-6 {
                    let floor_m = p.z as f32 / -rise * reach;
                    floor_from_m[sector] = floor_from_m[sector].min(floor_m.max(0.0));
                }
                rays.push(PixelRay { pixel: row * intrinsics.width() + column, sector: sector as u32, reach, rise });
            }
        }
        let camera_m = [p.x as f32, p.y as f32, p.z as f32];
        Self { intrinsics: *intrinsics, t_base_camera: *t_base_camera, rays, n_sectors, floor_from_m, camera_m }
    }

    /// True if the table was made for this camera.
    pub fn fits(&self, intrinsics: &Intrinsics, t_base_camera: &Transform<Base, Camera>) -> bool {
        self.intrinsics == *intrinsics && self.t_base_camera == *t_base_camera
    }
}

/// Sector of an azimuth in [-pi, pi].
pub fn sector_of(azimuth_rad: f32, n_sectors: usize) -> usize {
    let share = (azimuth_rad + core::f32::consts::PI) / core::f32::consts::TAU;
    ((share * n_sectors as f32) as usize).min(n_sectors - 1)
}

/// Azimuth of a sector's middle.
pub fn azimuth_of(sector: usize, n_sectors: usize) -> f32 {
    (sector as f32 + 0.5) / n_sectors as f32 * core::f32::consts::TAU - core::f32::consts::PI
}
