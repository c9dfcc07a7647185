//! SIFT keypoints (Lowe, IJCV 2004) by OpenCV, with RootSIFT descriptors (Arandjelovic and Zisserman, CVPR 2012).

use homing_core::{FeatureExtractor, Features, Keypoint, RgbImage};
use opencv::core::{KeyPoint, Mat, Ptr, Size, Vector, no_array};
use opencv::features2d::SIFT;
use opencv::imgproc;
use opencv::prelude::*;

use crate::PerceptionError;

/// OpenCV's SIFT enlarges the image twofold before it searches, and maps column x' of the large image to x'/2. The
/// centres of the pixels put it at x'/2 - 1/4: every keypoint is a quarter of a pixel too far right and down.
const ENLARGEMENT_SHIFT_PX: f32 = 0.25;

/// How many keypoints to keep, and from what size of image.
#[derive(Copy, Clone, Debug, PartialEq)]
pub struct SiftConfig {
    /// Most keypoints kept, strongest first.
    pub keypoints_max: usize,
    /// Weakest contrast of a keypoint (Lowe's, before division by the layers of an octave). 0.04 is Lowe's advice; a
    /// lower one finds enough points on plain walls, the cap keeps the strongest where there are many.
    pub contrast_min: f64,
    /// A larger image is shrunk to this longer side first, pixels. Keypoints are given in the original's pixels.
    pub side_max_px: u32,
}

impl Default for SiftConfig {
    fn default() -> Self {
        Self { keypoints_max: 1500, contrast_min: 0.02, side_max_px: 1280 }
    }
}

/// OpenCV's SIFT behind [`FeatureExtractor`].
pub struct Sift {
    sift: Ptr<SIFT>,
    config: SiftConfig,
}

impl Sift {
    /// # Errors
    /// [`PerceptionError::OpenCv`] if OpenCV refuses the parameters.
    pub fn new(config: SiftConfig) -> Result<Self, PerceptionError> {
        let n = i32::try_from(config.keypoints_max).unwrap_or(i32::MAX);
        let sift = create(SIFT::create, n, config.contrast_min).map_err(PerceptionError::opencv("create SIFT"))?;
        Ok(Self { sift, config })
    }

    fn detect(&mut self, image: &RgbImage) -> opencv::Result<Features> {
        let luma = image.to_luma();
        let full = Mat::new_rows_cols_with_data(image.height() as i32, image.width() as i32, &luma)?;
        let longer = image.width().max(image.height());
        let mut keypoints = Vector::<KeyPoint>::new();
        let mut descriptors = Mat::default();
        if longer <= self.config.side_max_px {
            self.sift.detect_and_compute_def(&full, &no_array(), &mut keypoints, &mut descriptors)?;
            let found = collect(&keypoints, &descriptors, (1.0, 1.0), self.config.keypoints_max)?;
            return Ok(Features { image_size_px: (image.width(), image.height()), ..found });
        }
        let shrink = |side: u32| {
            let scaled = f64::from(side) * f64::from(self.config.side_max_px) / f64::from(longer);
            (scaled.round() as i32).max(1)
        };
        let size = Size::new(shrink(image.width()), shrink(image.height()));
        let mut small = Mat::default();
        imgproc::resize(&full, &mut small, size, 0.0, 0.0, imgproc::INTER_AREA)?;
        self.sift.detect_and_compute_def(&small, &no_array(), &mut keypoints, &mut descriptors)?;
        let scale = (image.width() as f32 / size.width as f32, image.height() as f32 / size.height as f32);
        let found = collect(&keypoints, &descriptors, scale, self.config.keypoints_max)?;
        Ok(Features { image_size_px: (image.width(), image.height()), ..found })
    }
}

impl FeatureExtractor for Sift {
    type Error = PerceptionError;

    fn name(&self) -> &str {
        "sift"
    }

    fn extract(&mut self, image: &RgbImage) -> Result<Features, PerceptionError> {
        // SIFT's own filters need a few pixels around a point; smaller images have none to offer.
        if image.width().min(image.height()) < 16 {
            return Ok(Features { dimension: 128, ..Features::default() });
        }
        self.detect(image).map_err(PerceptionError::opencv("extract SIFT features"))
    }
}

/// Strongest first, in the original's pixels. Ties are broken by position, so that the order is the same whatever the
/// number of threads.
fn collect(
    keypoints: &Vector<KeyPoint>,
    descriptors: &Mat,
    scale: (f32, f32),
    keypoints_max: usize,
) -> opencv::Result<Features> {
    let found: Vec<KeyPoint> = keypoints.iter().collect();
    let mut order: Vec<usize> = (0..found.len()).collect();
    order.sort_by(|&i, &j| {
        let key = |k: &KeyPoint| (k.pt().y, k.pt().x, k.size(), k.angle());
        let (a, b) = (key(&found[i]), key(&found[j]));
        let position =
            a.0.total_cmp(&b.0).then(a.1.total_cmp(&b.1)).then(a.2.total_cmp(&b.2)).then(a.3.total_cmp(&b.3));
        found[j].response().total_cmp(&found[i].response()).then(position)
    });
    order.truncate(keypoints_max);
    let mut features = Features { dimension: 128, ..Features::default() };
    for i in order {
        let point = found[i].pt();
        let original = |x: f32, s: f32| (x - ENLARGEMENT_SHIFT_PX + 0.5) * s - 0.5;
        features.keypoints.push(Keypoint {
            x_px: original(point.x, scale.0),
            y_px: original(point.y, scale.1),
            score: found[i].response(),
        });
        root_sift(descriptors.at_row::<f32>(i as i32)?, &mut features.descriptors);
    }
    Ok(features)
}

/// Square root of the L1-normalised descriptor: the Euclidean distance becomes Hellinger's, and the length 1.
fn root_sift(descriptor: &[f32], into: &mut Vec<f32>) {
    let sum: f32 = descriptor.iter().map(|x| x.max(0.0)).sum();
    let inverse = if sum > 0.0 { 1.0 / sum } else { 0.0 };
    into.extend(descriptor.iter().map(|x| (x.max(0.0) * inverse).sqrt()));
}

/// Calls `SIFT::create` whatever its number of arguments: OpenCV 4.8 added one.
fn create<Arguments>(
    constructor: impl SiftConstructor<Arguments>,
    keypoints_max: i32,
    contrast_min: f64,
) -> opencv::Result<Ptr<SIFT>> {
    constructor.construct(keypoints_max, contrast_min)
}

trait SiftConstructor<Arguments> {
    fn construct(self, keypoints_max: i32, contrast_min: f64) -> opencv::Result<Ptr<SIFT>>;
}

/// Lowe's layers per octave, edge ratio and blur of the first layer.
const LAYERS: i32 = 3;
const EDGE_RATIO: f64 = 10.0;
const SIGMA: f64 = 1.6;

impl<F: Fn(i32, i32, f64, f64, f64) -> opencv::Result<Ptr<SIFT>>> SiftConstructor<(i32, i32, f64, f64, f64)> for F {
    fn construct(self, keypoints_max: i32, contrast_min: f64) -> opencv::Result<Ptr<SIFT>> {
        self(keypoints_max, LAYERS, contrast_min, EDGE_RATIO, SIGMA)
    }
}

impl<F: Fn(i32, i32, f64, f64, f64, bool) -> opencv::Result<Ptr<SIFT>>> SiftConstructor<(i32, i32, f64, f64, f64, bool)>
    for F
{
    fn construct(self, keypoints_max: i32, contrast_min: f64) -> opencv::Result<Ptr<SIFT>> {
        self(keypoints_max, LAYERS, contrast_min, EDGE_RATIO, SIGMA, false)
    }
}
