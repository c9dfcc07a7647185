//! The seam between images and geometry: keypoints, descriptors, matches.

use crate::image::RgbImage;

/// A point an extractor found.
#[derive(Copy, Clone, Debug, PartialEq)]
pub struct Keypoint {
    /// Column, pixels; the centre of the top-left pixel is (0, 0).
    pub x_px: f32,
    /// Row, pixels.
    pub y_px: f32,
    /// Strength; larger is better, comparable within one image.
    pub score: f32,
}

/// Keypoints of one image with their descriptors.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Features {
    /// n keypoints.
    pub keypoints: Vec<Keypoint>,
    /// n x `dimension` descriptors, row-major, unit length.
    pub descriptors: Vec<f32>,
    /// Length of one descriptor.
    pub dimension: usize,
    /// Columns and rows of the image they were found in, pixels; 0 where unknown. Matchers that attend to where a keypoint
    /// lies need it.
    pub image_size_px: (u32, u32),
}

/// A pair of keypoints held to show the same point.
#[derive(Copy, Clone, Debug, PartialEq)]
pub struct FeatureMatch {
    /// Index into the query's keypoints (the robot's image).
    pub query: usize,
    /// Index into the goal's keypoints.
    pub goal: usize,
    /// 0 to 1, larger is surer.
    pub confidence: f32,
}

/// Finds keypoints and describes them.
pub trait FeatureExtractor: Send {
    /// What goes wrong inside (a library's error, a model that does not fit).
    type Error: core::error::Error + Send + Sync + 'static;
    /// Name for configuration and reports.
    fn name(&self) -> &str;
    /// Features of one image, strongest first. An image without texture gives none; that is not an error.
    ///
    /// # Errors
    /// Only for faults of the extractor, never for what the image shows.
    fn extract(&mut self, image: &RgbImage) -> Result<Features, Self::Error>;
}

/// Pairs the features of two images.
pub trait Matcher: Send {
    /// What goes wrong inside.
    type Error: core::error::Error + Send + Sync + 'static;
    /// Name for configuration and reports.
    fn name(&self) -> &str;
    /// Matches, each keypoint used at most once. Empty inputs give no matches.
    ///
    /// # Errors
    /// Only for faults of the matcher, such as descriptors of unequal length.
    fn match_features(&mut self, query: &Features, goal: &Features) -> Result<Vec<FeatureMatch>, Self::Error>;
}

impl<E: FeatureExtractor + ?Sized> FeatureExtractor for Box<E> {
    type Error = E::Error;

    fn name(&self) -> &str {
        (**self).name()
    }

    fn extract(&mut self, image: &RgbImage) -> Result<Features, Self::Error> {
        (**self).extract(image)
    }
}

impl<M: Matcher + ?Sized> Matcher for Box<M> {
    type Error = M::Error;

    fn name(&self) -> &str {
        (**self).name()
    }

    fn match_features(&mut self, query: &Features, goal: &Features) -> Result<Vec<FeatureMatch>, Self::Error> {
        (**self).match_features(query, goal)
    }
}
