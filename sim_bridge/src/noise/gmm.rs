//! Mixtures of Gaussians in three dimensions, sampled alike on every CPU.

use core::f64::consts::TAU;

use rand::RngExt;
use rand_chacha::ChaCha8Rng;
use thiserror::Error;

/// A vector of the mixture's space; its units are the mixture's.
pub type Vector = [f64; 3];

/// One Gaussian of a mixture.
#[derive(Copy, Clone, Debug, PartialEq)]
pub struct Component {
    /// Its share of the mixture, 0 to 1.
    pub weight: f64,
    /// Its mean.
    pub mean: Vector,
    /// Its covariance, full and symmetric.
    pub covariance: [Vector; 3],
}

/// Why components are no mixture.
#[derive(Copy, Clone, Debug, PartialEq, Error)]
pub enum MixtureError {
    /// Weights are shares of a whole.
    #[error("the weights of a mixture add up to {sum}, not to 1")]
    Weights {
        /// What they add up to.
        sum: f64,
    },
    /// A covariance is symmetric and positive definite.
    #[error("the covariance of component {index} is not symmetric and positive definite")]
    Covariance {
        /// Which component, from 0.
        index: usize,
    },
}

/// A mixture of Gaussians with full covariances.
#[derive(Clone, Debug, PartialEq)]
pub struct Mixture {
    parts: Vec<Part>,
}

/// A component ready to be drawn from: mean + L z with z standard normal and L L^T the covariance.
#[derive(Copy, Clone, Debug, PartialEq)]
struct Part {
    weight: f64,
    mean: Vector,
    lower: [Vector; 3],
}

impl Mixture {
    /// From its components.
    ///
    /// # Errors
    /// [`MixtureError`] when the weights do not add up to 1 or a covariance is none.
    pub fn new(components: &[Component]) -> Result<Self, MixtureError> {
        let sum: f64 = components.iter().map(|c| c.weight).sum();
        if sum.is_nan() || (sum - 1.0).abs() > 1e-9 || components.iter().any(|c| c.weight < 0.0) {
            return Err(MixtureError::Weights { sum });
        }
        let wrong = components.iter().position(|c| !is_symmetric(&c.covariance) || !has_full_rank(&c.covariance));
        match wrong {
            Some(index) => Err(MixtureError::Covariance { index }),
            None => Ok(Self::unchecked(components)),
        }
    }

    /// For tables of this crate, which a test puts through [`Mixture::new`].
    pub(super) fn unchecked(components: &[Component]) -> Self {
        let part = |c: &Component| Part { weight: c.weight, mean: c.mean, lower: cholesky(&c.covariance) };
        Self { parts: components.iter().map(part).collect() }
    }

    /// Draws one vector. Every draw takes the same amount of randomness: one number for the component, four for the
    /// three normal deviates (Box and Muller make two at a time).
    pub fn sample(&self, rng: &mut ChaCha8Rng) -> Vector {
        let mut left = rng.random::<f64>();
        let (z0, z1) = normal_pair(rng);
        let (z2, _) = normal_pair(rng);
        for (i, part) in self.parts.iter().enumerate() {
            left -= part.weight;
            // Rounding may leave a trace of the whole: it is the last one's.
            if left < 0.0 || i + 1 == self.parts.len() {
                return part.place([z0, z1, z2]);
            }
        }
        [0.0; 3]
    }

    /// Mean of the mixture.
    #[must_use]
    pub fn mean(&self) -> Vector {
        core::array::from_fn(|k| self.parts.iter().map(|p| p.weight * p.mean[k]).sum())
    }

    /// Standard deviation of the mixture along each axis, the spread of its components' means included.
    #[must_use]
    pub fn standard_deviation(&self) -> Vector {
        let mean = self.mean();
        core::array::from_fn(|k| {
            let variance = |p: &Part| p.lower[k].iter().map(|l| l * l).sum::<f64>() + (p.mean[k] - mean[k]).powi(2);
            libm::sqrt(self.parts.iter().map(|p| p.weight * variance(p)).sum())
        })
    }
}

impl Part {
    fn place(&self, z: Vector) -> Vector {
        core::array::from_fn(|row| self.mean[row] + (0..=row).map(|k| self.lower[row][k] * z[k]).sum::<f64>())
    }
}

/// Two independent standard normal deviates (Box and Muller 1958).
fn normal_pair(rng: &mut ChaCha8Rng) -> (f64, f64) {
    // `random` is in [0, 1): 1 - u is never 0.
    let radius = libm::sqrt(-2.0 * libm::log(1.0 - rng.random::<f64>()));
    let angle = TAU * rng.random::<f64>();
    (radius * libm::cos(angle), radius * libm::sin(angle))
}

/// Lower triangle L with L L^T = `a`. A direction without variance gets a column of zeros.
fn cholesky(a: &[Vector; 3]) -> [Vector; 3] {
    let mut lower = [[0.0; 3]; 3];
    for column in 0..3 {
        let known: f64 = (0..column).map(|k| lower[column][k] * lower[column][k]).sum();
        let pivot = a[column][column] - known;
        if pivot > 0.0 {
            lower[column][column] = libm::sqrt(pivot);
            for row in column + 1..3 {
                let known: f64 = (0..column).map(|k| lower[row][k] * lower[column][k]).sum();
                lower[row][column] = (a[row][column] - known) / lower[column][column];
            }
        }
    }
    lower
}

fn is_symmetric(a: &[Vector; 3]) -> bool {
    (0..3).all(|i| (0..i).all(|j| (a[i][j] - a[j][i]).abs() <= 1e-9 * libm::sqrt((a[i][i] * a[j][j]).abs())))
}

fn has_full_rank(a: &[Vector; 3]) -> bool {
    let lower = cholesky(a);
    (0..3).all(|i| lower[i][i] > 0.0 && lower[i].iter().all(|l| l.is_finite()))
}

#[cfg(test)]
#[expect(clippy::unwrap_used, reason = "a test may fail by panicking")]
mod tests {
    use rand::SeedableRng;

    use super::*;

    const UNIT: [Vector; 3] = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];

    fn one(covariance: [Vector; 3]) -> [Component; 1] {
        [Component { weight: 1.0, mean: [0.0; 3], covariance }]
    }

    #[test]
    fn the_triangle_of_a_covariance_by_hand() {
        // [[4, 2, 0], [2, 5, 2], [0, 2, 5]] = L L^T with L = [[2, 0, 0], [1, 2, 0], [0, 1, 2]].
        let lower = cholesky(&[[4.0, 2.0, 0.0], [2.0, 5.0, 2.0], [0.0, 2.0, 5.0]]);
        assert_eq!(lower, [[2.0, 0.0, 0.0], [1.0, 2.0, 0.0], [0.0, 1.0, 2.0]]);
    }

    #[test]
    fn moments_of_a_mixture_by_hand() {
        // Half at -1, half at 3, each of variance 1: mean 1, variance 1 + 4.
        let at = |x: f64| Component { weight: 0.5, mean: [x, 0.0, 7.0], covariance: UNIT };
        let mixture = Mixture::new(&[at(-1.0), at(3.0)]).unwrap();
        assert_eq!(mixture.mean(), [1.0, 0.0, 7.0]);
        let sd = mixture.standard_deviation();
        assert!((sd[0] - 5.0_f64.sqrt()).abs() < 1e-12 && (sd[1] - 1.0).abs() < 1e-12, "{sd:?}");
    }

    #[test]
    fn samples_have_the_covariance_and_the_shares_asked_for() {
        const N: usize = 200_000;
        let covariance = [[4.0, 2.0, 0.0], [2.0, 5.0, 2.0], [0.0, 2.0, 5.0]];
        let far = Component { weight: 0.25, mean: [1000.0, 0.0, 0.0], covariance };
        let near = Component { weight: 0.75, mean: [1.0, -2.0, 3.0], covariance };
        let mixture = Mixture::new(&[far, near]).unwrap();
        let rng = &mut ChaCha8Rng::seed_from_u64(5);
        let samples: Vec<Vector> = (0..N).map(|_| mixture.sample(rng)).collect();
        let near: Vec<&Vector> = samples.iter().filter(|s| s[0] < 500.0).collect();
        let share = near.len() as f64 / N as f64;
        // Standard error of a share of 0.75: 0.001.
        assert!((share - 0.75).abs() < 0.004, "{share}");
        let n = near.len() as f64;
        for (i, row) in covariance.iter().enumerate() {
            for (j, expected) in row.iter().enumerate() {
                let mean = [1.0, -2.0, 3.0];
                let found = near.iter().map(|s| (s[i] - mean[i]) * (s[j] - mean[j])).sum::<f64>() / n;
                // Standard error of a product of two deviates of variance 5: at most 0.02.
                assert!((found - expected).abs() < 0.08, "covariance ({i}, {j}): {found} instead of {expected}");
            }
        }
    }

    #[test]
    fn what_is_no_mixture_is_refused() {
        let half = [Component { weight: 0.5, mean: [0.0; 3], covariance: UNIT }];
        assert_eq!(Mixture::new(&half), Err(MixtureError::Weights { sum: 0.5 }));
        assert!(matches!(Mixture::new(&[]), Err(MixtureError::Weights { .. })));
        let nan = [Component { weight: f64::NAN, mean: [0.0; 3], covariance: UNIT }];
        assert!(matches!(Mixture::new(&nan), Err(MixtureError::Weights { .. })));
        let lopsided = [[1.0, 0.5, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
        assert_eq!(Mixture::new(&one(lopsided)), Err(MixtureError::Covariance { index: 0 }));
        let indefinite = [[1.0, 2.0, 0.0], [2.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
        assert_eq!(Mixture::new(&one(indefinite)), Err(MixtureError::Covariance { index: 0 }));
    }
}
