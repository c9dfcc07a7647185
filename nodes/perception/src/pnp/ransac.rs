//! LO-RANSAC with the MSAC score on angular errors: a minimal sample makes a pose, every new best is refined on all that
//! agree with it (Chum, Matas, Kittler, "Locally optimized RANSAC", DAGM 2003; Torr and Zisserman, "MLESAC", 2000).

use nalgebra::{ComplexField, Point3};
use rand::{Rng, RngExt};
use thiserror::Error;

use super::local::LocalOptimizer;
use super::scorer::Scorer;
use super::{CameraPose, Correspondence, Upright, covariance, p3p, up2p};

/// How hard to search for a consensus.
#[derive(Copy, Clone, Debug, PartialEq)]
pub struct RansacConfig {
    /// Largest angular error of an inlier, radians.
    pub gate_rad: f64,
    /// Fewest inliers of interest: the search ends once such a set would have been found.
    pub n_inliers_min: usize,
    /// Probability of drawing at least one sample of inliers alone.
    pub confidence: f64,
    /// Most samples drawn.
    pub iterations_max: usize,
}

/// The pose most correspondences agree on.
#[derive(Clone, Debug, PartialEq)]
pub struct Consensus {
    /// The pose.
    pub pose: CameraPose,
    /// Indices of the correspondences within the gate.
    pub inliers: Vec<usize>,
    /// Samples drawn.
    pub iterations: usize,
}

/// Why correspondences give no pose.
#[derive(Copy, Clone, Debug, PartialEq, Error)]
pub enum NoPose {
    /// There are too few to begin with.
    #[error("{n_usable} of {n} correspondences are finite, {n_min} are needed")]
    TooFew {
        /// Correspondences.
        n: usize,
        /// Those of finite numbers.
        n_usable: usize,
        /// Fewest of interest.
        n_min: usize,
    },
    /// No sample has a solution: the points coincide or lie in line, or the rays do.
    #[error("none of {iterations} samples fixes a pose: the points lie in line or coincide")]
    Degenerate {
        /// Samples drawn.
        iterations: usize,
    },
    /// Too few agree on any pose.
    #[error("at most {n_inliers} correspondences agree on a pose after {iterations} samples, {n_min} are needed")]
    NoConsensus {
        /// Most that agree.
        n_inliers: usize,
        /// Fewest of interest.
        n_min: usize,
        /// Samples drawn.
        iterations: usize,
    },
    /// Enough agree, but on a whole family of poses: nearly in line, or nearly at one place.
    #[error("{n_inliers} correspondences agree, but leave the pose open by {sd_m} m and {sd_rad} rad")]
    Undetermined {
        /// Those that agree.
        n_inliers: usize,
        /// One standard deviation of the position in its least certain direction, metres.
        sd_m: f64,
        /// One standard deviation of the rotation about its least certain axis, radians.
        sd_rad: f64,
    },
}

/// A pose is undetermined where one standard deviation of its rotation exceeds this, radians.
const SD_RAD_MAX: f64 = 0.3;

/// ... or where that of its position exceeds this share of the mean distance to the points.
const SD_SHARE_MAX: f64 = 0.5;

/// Samples drawn for each one that the confidence asks for: noise spoils some samples of inliers alone.
const SAMPLES_FACTOR: f64 = 1.5;

/// Searches the pose with the best MSAC score by samples of three.
///
/// # Errors
/// [`NoPose`] unless at least `n_inliers_min` (no fewer than 4: three agree on anything) agree on one.
pub fn lo_ransac(
    correspondences: &[Correspondence],
    config: &RansacConfig,
    rng: &mut impl Rng,
) -> Result<Consensus, NoPose> {
    let mut search = Search::new(correspondences, config, rng)?;
    search.run(&ThreePoints, config.iterations_max, rng);
    search.consensus()
}

/// Searches by samples of two and the known direction of up, then by as many samples of three, so that a wrong direction
/// costs time, not the pose: where samples of three find a better pose, or those of two none, the search is theirs.
///
/// # Errors
/// As [`lo_ransac`].
pub fn gravity_ransac(
    correspondences: &[Correspondence],
    upright: &Upright,
    config: &RansacConfig,
    rng: &mut impl Rng,
) -> Result<Consensus, NoPose> {
    let mut search = Search::new(correspondences, config, rng)?;
    search.run(upright, config.iterations_max, rng);
    let (drawn, by_two) = (search.iterations, search.best_score());
    let found = search.consensus().is_ok();
    let check = if found { drawn } else { config.iterations_max };
    search.run(&ThreePoints, check, rng);
    if found && search.best_score() < BETTER * by_two {
        search.run(&ThreePoints, config.iterations_max, rng);
    }
    search.consensus()
}

/// Share of the score below which another pose is better by more than where its optimisation began.
const BETTER: f32 = 0.98;

/// A way to make poses from the fewest correspondences.
trait Kernel {
    /// Correspondences in a sample, at most three.
    const SIZE: usize;
    /// Appends the poses that a sample allows; the first `SIZE` of the three are to be used.
    fn poses(&self, sample: [&Correspondence; 3], poses: &mut Vec<CameraPose>);
}

struct ThreePoints;

impl Kernel for ThreePoints {
    const SIZE: usize = 3;

    fn poses(&self, sample: [&Correspondence; 3], poses: &mut Vec<CameraPose>) {
        p3p(&sample.map(|c| c.ray.into_inner()), &sample.map(|c| c.point), poses);
    }
}

impl Kernel for Upright {
    const SIZE: usize = 2;

    fn poses(&self, [first, second, _]: [&Correspondence; 3], poses: &mut Vec<CameraPose>) {
        up2p(&[first.ray.into_inner(), second.ray.into_inner()], &[first.point, second.point], self, poses);
    }
}

/// The state of a search: nothing is allocated once it is made.
struct Search<'a> {
    correspondences: &'a [Correspondence],
    config: RansacConfig,
    n_min: usize,
    /// Indices of the correspondences of finite numbers, in random order.
    usable: Vec<usize>,
    scorer: Scorer,
    local: LocalOptimizer,
    best: Option<(f32, CameraPose)>,
    iterations: usize,
    candidates: Vec<CameraPose>,
}

impl<'a> Search<'a> {
    fn new(correspondences: &'a [Correspondence], config: &RansacConfig, rng: &mut impl Rng) -> Result<Self, NoPose> {
        let n_min = config.n_inliers_min.max(4);
        let mut usable: Vec<usize> = (0..correspondences.len()).filter(|&i| is_usable(&correspondences[i])).collect();
        if usable.len() < n_min {
            return Err(NoPose::TooFew { n: correspondences.len(), n_usable: usable.len(), n_min });
        }
        // Neighbours in the image are neighbours in the list: only in random order is a part like the whole.
        for i in (1..usable.len()).rev() {
            usable.swap(i, rng.random_range(0..=i));
        }
        Ok(Self {
            correspondences,
            config: *config,
            n_min,
            scorer: Scorer::new(correspondences, &usable, config.gate_rad),
            local: LocalOptimizer::new(correspondences, &usable, config.gate_rad),
            usable,
            best: None,
            iterations: 0,
            candidates: Vec::with_capacity(4),
        })
    }

    /// Draws samples until a better pose would have been met with the wanted confidence, at most `iterations_max`.
    fn run<K: Kernel>(&mut self, kernel: &K, iterations_max: usize, rng: &mut impl Rng) {
        let mut needed = self.samples_needed::<K>(self.n_inliers()).min(iterations_max);
        let mut drawn = 0;
        while drawn < needed {
            drawn += 1;
            let sample = self.draw(rng);
            kernel.poses(sample.map(|at| &self.correspondences[self.usable[at]]), &mut self.candidates);
            while let Some(pose) = self.candidates.pop() {
                let bound = self.best_score();
                let Some(score) = self.scorer.score_sample(&pose, bound, &sample[..K::SIZE]) else { continue };
                self.best = Some(self.local.optimise(pose, score, &self.scorer));
                let n_inliers = self.n_inliers();
                self.scorer.expect(n_inliers);
                needed = needed.min(self.samples_needed::<K>(n_inliers));
            }
        }
        self.iterations += drawn;
    }

    /// The best score so far. One that no inlier improved is of no interest.
    fn best_score(&self) -> f32 {
        self.best.as_ref().map_or(self.usable.len() as f32, |(score, _)| *score)
    }

    fn n_inliers(&self) -> usize {
        let gate = self.config.gate_rad * self.config.gate_rad;
        let agrees = |pose: &CameraPose, &&i: &&usize| pose.squared_error(&self.correspondences[i]) < gate;
        self.best.as_ref().map_or(0, |(_, pose)| self.usable.iter().filter(|i| agrees(pose, i)).count())
    }

    /// Samples after which one of inliers alone has been drawn with the wanted confidence.
    fn samples_needed<K: Kernel>(&self, n_inliers: usize) -> usize {
        let (n, k) = (self.usable.len(), n_inliers.max(self.n_min));
        let all_inliers: f64 = (0..K::SIZE).map(|i| (k - i) as f64 / (n - i) as f64).product();
        if all_inliers > 0.999 {
            return 1;
        }
        let needed = ComplexField::ln(1.0 - self.config.confidence) / ComplexField::ln_1p(-all_inliers);
        // Saturates: a float beyond usize becomes its maximum.
        ((SAMPLES_FACTOR * needed).ceil() as usize).max(1)
    }

    /// Three different positions in `usable`.
    fn draw(&self, rng: &mut impl Rng) -> [usize; 3] {
        let n = self.usable.len();
        let i = rng.random_range(0..n);
        let j = (i + rng.random_range(1..n)) % n;
        let k = loop {
            let k = rng.random_range(0..n);
            if k != i && k != j {
                break k;
            }
        };
        [i, j, k]
    }

    fn consensus(&self) -> Result<Consensus, NoPose> {
        let Some((_, pose)) = self.best else { return Err(NoPose::Degenerate { iterations: self.iterations }) };
        let inliers = pose.inliers(self.correspondences, self.config.gate_rad);
        let (n_inliers, n_min, iterations) = (inliers.len(), self.n_min, self.iterations);
        if n_inliers < n_min {
            return Err(NoPose::NoConsensus { n_inliers, n_min, iterations });
        }
        let (sd_m, sd_rad) = spread(&pose, self.correspondences, &inliers);
        let mean_m = inliers.iter().map(|&i| pose.to_goal(&self.correspondences[i].point).norm()).sum::<f64>()
            / n_inliers as f64;
        if !(sd_rad < SD_RAD_MAX && sd_m < SD_SHARE_MAX * mean_m) {
            return Err(NoPose::Undetermined { n_inliers, sd_m, sd_rad });
        }
        Ok(Consensus { pose, inliers, iterations })
    }
}

/// Finite, no farther than single precision carries, and with a ray that has a direction.
fn is_usable(correspondence: &Correspondence) -> bool {
    const FARTHEST_M: f64 = 1e6;
    let Point3 { coords } = correspondence.point;
    coords.iter().all(|x| x.abs() < FARTHEST_M) && (correspondence.ray.norm_squared() - 1.0).abs() < 1e-3
}

/// One standard deviation of position (metres) and rotation (radians) where they are least certain; infinite if nothing
/// holds the pose.
fn spread(pose: &CameraPose, correspondences: &[Correspondence], inliers: &[usize]) -> (f64, f64) {
    let Some(covariance) = covariance(pose, correspondences, inliers) else { return (f64::INFINITY, f64::INFINITY) };
    let largest = |at: usize| covariance.fixed_view::<3, 3>(at, at).symmetric_eigenvalues().max().max(0.0).sqrt();
    (largest(0), largest(3))
}
