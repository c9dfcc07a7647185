//! Normal deviates for every pixel of an image, by counting: a pixel's randomness depends on the image's seed and the
//! pixel's index alone, so that rows can be worked on in any order, by any number of threads.

use std::sync::LazyLock;

/// Entries of the table; a power of two.
const QUANTILES: usize = 4096;
const INDEX_BITS: u32 = QUANTILES.ilog2();

/// Quantiles of the standard normal distribution at equal steps of probability, of variance 1. The largest is 3.7: a
/// tenth of a percent of the variance lies beyond, which images of 8 bits do not show.
static NORMAL: LazyLock<[f32; QUANTILES]> = LazyLock::new(|| {
    let half = QUANTILES / 2;
    let upper: Vec<f64> = (0..half).map(|k| quantile(0.5 + (k as f64 + 0.5) / QUANTILES as f64)).collect();
    let sd = libm::sqrt(upper.iter().map(|q| q * q).sum::<f64>() / half as f64);
    core::array::from_fn(|k| {
        let q = if k < half { -upper[half - 1 - k] } else { upper[k - half] };
        (q / sd) as f32
    })
});

/// The value below which a standard normal deviate stays with a probability of 0.5 to 1.
fn quantile(probability: f64) -> f64 {
    let (mut low, mut high) = (0.0, 8.0);
    for _ in 0..60 {
        let middle = 0.5 * (low + high);
        let above = 0.5 * libm::erfc(middle * core::f64::consts::FRAC_1_SQRT_2);
        if 1.0 - above < probability { low = middle } else { high = middle }
    }
    0.5 * (low + high)
}

/// Three standard normal deviates for a pixel of the image with this seed.
pub fn normals(table: &[f32; QUANTILES], seed: u64, pixel: u64) -> [f32; 3] {
    let bits = mix(seed ^ mix(pixel));
    let take = |k: u32| table[(bits >> (64 - (k + 1) * INDEX_BITS)) as usize & (QUANTILES - 1)];
    [take(0), take(1), take(2)]
}

/// The table for [`normals`].
pub fn table() -> &'static [f32; QUANTILES] {
    &NORMAL
}

/// A number that differs in about half of its bits for every other input: SplitMix64's step (Steele et al. 2014).
pub fn mix(input: u64) -> u64 {
    let mut z = input.wrapping_add(0x9e37_79b9_7f4a_7c15);
    z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    z ^ (z >> 31)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn quantiles_of_the_normal_distribution() {
        // Tabulated: 75 %, 97.5 %, 99.9 %.
        for (probability, expected) in [(0.5, 0.0), (0.75, 0.674_490), (0.975, 1.959_964), (0.999, 3.090_232)] {
            assert!((quantile(probability) - expected).abs() < 1e-5, "{probability}: {}", quantile(probability));
        }
    }

    #[test]
    fn deviates_of_an_image_are_standard_normal_and_independent() {
        const N: u64 = 300_000;
        let drawn: Vec<[f32; 3]> = (0..N).map(|pixel| normals(table(), 17, pixel)).collect();
        let mean_of = |f: &dyn Fn(&[f32; 3]) -> f32| drawn.iter().map(|z| f64::from(f(z))).sum::<f64>() / N as f64;
        // Standard error of a mean of N deviates: 0.0018; of their squares: 0.0026.
        for k in 0..3 {
            assert!(mean_of(&|z| z[k]).abs() < 0.008, "mean {k}");
            assert!((mean_of(&|z| z[k] * z[k]) - 1.0).abs() < 0.011, "variance {k}");
            assert!(mean_of(&|z| z[k] * z[(k + 1) % 3]).abs() < 0.008, "correlation {k}");
        }
        let beyond_two = mean_of(&|z| if z[0].abs() > 2.0 { 1.0 } else { 0.0 });
        assert!((beyond_two - 0.0455).abs() < 0.002, "{beyond_two} lie beyond two deviations");
        let neighbours = drawn.windows(2).map(|w| f64::from(w[0][0] * w[1][0])).sum::<f64>() / N as f64;
        assert!(neighbours.abs() < 0.008, "neighbours are correlated: {neighbours}");
    }

    #[test]
    fn another_seed_is_another_image() {
        let equal = (0..1000).filter(|p| normals(table(), 1, *p) == normals(table(), 2, *p)).count();
        assert_eq!(equal, 0);
        assert_eq!(normals(table(), 1, 5), normals(table(), 1, 5));
    }
}
