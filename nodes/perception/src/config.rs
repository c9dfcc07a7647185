//! Every knob of perception, with its default.

use crate::PerceptionError;
use crate::lift::DepthModel;
use crate::sift::SiftConfig;

/// Which solver turns correspondences into a pose.
#[derive(Copy, Clone, Debug, Default, PartialEq, Eq)]
pub enum PoseSolver {
    /// Three-point kernel, local optimisation, robust refinement.
    #[default]
    LoRansac,
    /// Two points and the known direction of up in both cameras ([`PerceptionConfig::camera_down_rad`] and
    /// [`PerceptionConfig::goal_down_rad`]), then the same. Without one of them, or where up is not where it was said to
    /// be: three points.
    Gravity,
    /// OpenCV's EPnP + RANSAC, as in SLING's published code; no refinement, no guided matching.
    EpnpRansac,
    /// The same, and the goal placed by SLING's own heading formula, which is wrong by the angle between the two cameras
    /// ([`crate::pnp::sling_heading`]): an ablation.
    SlingHeading,
}

/// When a goal counts as seen. All errors are angles, so that the same gates fit every camera.
#[derive(Copy, Clone, Debug, PartialEq)]
pub struct Gates {
    /// n_th: fewest matches that agree on a pose (SLING 3.4), counted before guided matching adds to them.
    pub n_inliers_min: usize,
    /// Smallest share of the matches that a pose must explain.
    pub inlier_share_min: f64,
    /// Largest angular error of a verified match, radians.
    pub error_rad_max: f64,
    /// Fewest patches of the photo that the frame, drawn from the pose, must cover with contrast.
    pub n_patches_min: usize,
    /// Smallest share of them that must look like the photo.
    pub patch_share_min: f64,
    /// Fewest verified matches of a bearing without depth: a line binds a match less than a point.
    pub n_bearing_min: usize,
    /// Smallest share of the matches that a bearing must explain.
    pub bearing_share_min: f64,
}

impl Default for Gates {
    /// Between frames of two unrelated rooms (1,350 pairs, 45 matches each on average) at most 6 matches agreed on a
    /// pose; without depth (162 pairs) at most 14 and a third of the matches agreed on a bearing. Measured by the example
    /// `unrelated`. Things that are really there twice, such as two prints of one poster, agree in larger numbers: what
    /// the patches are for. The example `proof` says what they keep and refuse on pairs of views of validation
    /// flats: at 0.6 nine in ten of the right poses stay and one in five of the wrong ones, at 0.4 49 in 50 and one in three.
    /// A robot sees hundreds of views without the goal for each that shows it: at 0.4 wrong places led it astray. With depth
    /// that is not registered to the colour 0.6 refuses a quarter of the right poses, 0.4 one in twenty.
    fn default() -> Self {
        Self {
            n_inliers_min: 7,
            inlier_share_min: 0.1,
            error_rad_max: 0.008,
            n_patches_min: 12,
            patch_share_min: 0.6,
            n_bearing_min: 25,
            bearing_share_min: 0.4,
        }
    }
}

/// Settings of a [`crate::GoalEstimator`].
#[derive(Copy, Clone, Debug, PartialEq)]
pub struct PerceptionConfig {
    /// Keypoints.
    pub sift: SiftConfig,
    /// Largest ratio of the matcher's ratio test.
    pub ratio_max: f32,
    /// Depth.
    pub depth: DepthModel,
    /// One standard deviation of a keypoint's position, pixels.
    pub keypoint_sd_px: f64,
    /// One standard deviation of what the intrinsics and the depth's scale are off by, as a share (0.005 is half a
    /// percent). It widens the covariance of every pose: by this share of the mean depth, and by as many radians.
    pub calibration_sd: f64,
    /// Pose solver.
    pub solver: PoseSolver,
    /// How far the robot's camera looks down, radians (0: level, negative: up), from its mount. It must not be rolled.
    /// `None` if not known.
    pub camera_down_rad: Option<f64>,
    /// The same of the camera that took the photo. `None` if not known.
    pub goal_down_rad: Option<f64>,
    /// When a goal counts as seen.
    pub gates: Gates,
    /// Probability with which RANSAC finds the pose if there is one.
    pub confidence: f64,
    /// Most samples RANSAC draws.
    pub iterations_max: usize,
    /// Poses tried for one frame: those before the last were not borne out by the photo.
    pub hypotheses_max: u32,
    /// Rounds of guided matching after the first pose: the second looks from the pose the first one refined.
    pub guided_rounds: u32,
    /// Seed of RANSAC's samples; each frame mixes its stamp into it.
    pub seed: u64,
    /// Threads OpenCV may use, for the whole process; `None` leaves its own choice. Results do not depend on it.
    pub threads: Option<u16>,
}

impl Default for PerceptionConfig {
    fn default() -> Self {
        Self {
            sift: SiftConfig::default(),
            ratio_max: 0.85,
            depth: DepthModel::default(),
            keypoint_sd_px: 0.7,
            calibration_sd: 0.005,
            solver: PoseSolver::default(),
            camera_down_rad: None,
            goal_down_rad: None,
            gates: Gates::default(),
            confidence: 0.9999,
            iterations_max: 10_000,
            hypotheses_max: 5,
            guided_rounds: 2,
            seed: 0,
            threads: None,
        }
    }
}

impl PerceptionConfig {
    /// # Errors
    /// [`PerceptionError::Setting`] names the first setting outside its range.
    pub fn check(&self) -> Result<(), PerceptionError> {
        let g = &self.gates;
        let rules = [
            ("keypoints_max", self.sift.keypoints_max as f64, (8.0, 20_000.0), "8..=20000"),
            ("contrast_min", self.sift.contrast_min, (0.0, 1.0), "0..=1"),
            ("side_max_px", f64::from(self.sift.side_max_px), (64.0, 8192.0), "64..=8192"),
            ("ratio_max", f64::from(self.ratio_max), (0.1, 1.0), "0.1..=1"),
            ("depth.step_max", f64::from(self.depth.step_max), (1e-3, 10.0), "0.001..=10"),
            ("depth.sd_m", self.depth.sd_m, (0.0, 1.0), "0..=1 m"),
            ("depth.sd_per_m2", self.depth.sd_per_m2, (0.0, 1.0), "0..=1 /m"),
            ("keypoint_sd_px", self.keypoint_sd_px, (0.01, 20.0), "0.01..=20 px"),
            ("calibration_sd", self.calibration_sd, (0.0, 1.0), "0..=1"),
            ("n_inliers_min", g.n_inliers_min as f64, (4.0, 10_000.0), "4..=10000"),
            ("inlier_share_min", g.inlier_share_min, (0.0, 1.0), "0..=1"),
            ("error_rad_max", g.error_rad_max, (1e-5, 0.2), "0.00001..=0.2 rad"),
            ("n_patches_min", g.n_patches_min as f64, (0.0, 10_000.0), "0..=10000"),
            ("patch_share_min", g.patch_share_min, (0.0, 1.0), "0..=1"),
            ("hypotheses_max", f64::from(self.hypotheses_max), (1.0, 100.0), "1..=100"),
            ("n_bearing_min", g.n_bearing_min as f64, (6.0, 10_000.0), "6..=10000"),
            ("bearing_share_min", g.bearing_share_min, (0.0, 1.0), "0..=1"),
            ("confidence", self.confidence, (0.5, 1.0 - 1e-12), "0.5..1"),
            ("camera_down_rad", self.camera_down_rad.unwrap_or(0.0), (-1.6, 1.6), "-1.6..=1.6 rad"),
            ("goal_down_rad", self.goal_down_rad.unwrap_or(0.0), (-1.6, 1.6), "-1.6..=1.6 rad"),
            ("guided_rounds", f64::from(self.guided_rounds), (0.0, 10.0), "0..=10"),
            ("iterations_max", self.iterations_max as f64, (1.0, 1e7), "1..=10000000"),
        ];
        for (name, value, (low, high), range) in rules {
            if !(value >= low && value <= high) {
                return Err(PerceptionError::Setting { name, value, range });
            }
        }
        Ok(())
    }
}
