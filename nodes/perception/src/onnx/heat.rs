//! Heat maps: softmax over cells of logits, weighting by reliability, exponentials.

/// Side of the cells in which XFeat-like networks think, pixels.
pub const CELL: usize = 8;
/// Logits per cell: one per pixel and one for "no keypoint here".
pub const LOGITS: usize = CELL * CELL + 1;

/// e^x to 4e-6 of its value for |x| < 87; beyond, it saturates. Written so that the compiler can do several at a time, and
/// the same on every machine: the whole part of x log2 e goes into the exponent, the rest through its Taylor series.
#[inline]
#[must_use]
pub fn exp(x: f32) -> f32 {
    /// Adding 1.5 * 2^23 leaves no bits for the fraction: the sum is rounded, and its low bits are the integer.
    const ROUND: f32 = 12_582_912.0;
    let t = x.clamp(-87.0, 87.0) * core::f32::consts::LOG2_E;
    let rounded = t + ROUND;
    let f = (t - (rounded - ROUND)) * core::f32::consts::LN_2;
    let fraction =
        1.0 + f * (1.0 + f * (0.5 + f * (1.0 / 6.0 + f * (1.0 / 24.0 + f * (1.0 / 120.0 + f * (1.0 / 720.0))))));
    let exponent = rounded.to_bits().wrapping_sub(ROUND.to_bits()).wrapping_add(127) << 23;
    fraction * f32::from_bits(exponent)
}

/// Probability of a keypoint per pixel, from logits of 65 planes of `columns` x `rows` cells: a softmax over each cell, the
/// last dropped, the other 64 laid out as 8 x 8 pixels. `heat` becomes (8 columns) x (8 rows), row-major.
pub fn heat_from_logits(logits: &[f32], columns: usize, rows: usize, heat: &mut Vec<f32>) {
    let plane = columns * rows;
    debug_assert_eq!(logits.len(), LOGITS * plane);
    heat.clear();
    heat.resize(CELL * CELL * plane, 0.0);
    let mut powers = vec![0.0; LOGITS * columns];
    for (y, lines) in heat.chunks_exact_mut(CELL * CELL * columns).enumerate() {
        let line = |channel: usize| &logits[channel * plane + y * columns..][..columns];
        let mut largest = line(0).to_vec();
        for channel in 1..LOGITS {
            for (largest, &x) in largest.iter_mut().zip(line(channel)) {
                *largest = largest.max(x);
            }
        }
        let mut sums = vec![0.0; columns];
        for (channel, powers) in powers.chunks_exact_mut(columns).enumerate() {
            for (((power, sum), &x), &largest) in powers.iter_mut().zip(&mut sums).zip(line(channel)).zip(&largest) {
                *power = exp(x - largest);
                *sum += *power;
            }
        }
        for sum in &mut sums {
            *sum = 1.0 / *sum;
        }
        for (i, line) in lines.chunks_exact_mut(CELL * columns).enumerate() {
            for (x, pixels) in line.as_chunks_mut::<CELL>().0.iter_mut().enumerate() {
                for (j, pixel) in pixels.iter_mut().enumerate() {
                    *pixel = powers[(CELL * i + j) * columns + x] * sums[x];
                }
            }
        }
    }
}

/// `heat` times `reliability`, which has one value per 8 x 8 cell of `columns` x `rows` cells and is interpolated
/// bilinearly between the cells' centres.
pub fn weigh(heat: &[f32], reliability: &[f32], columns: usize, rows: usize, weighted: &mut Vec<f32>) {
    debug_assert_eq!((heat.len(), reliability.len()), (CELL * CELL * columns * rows, columns * rows));
    weighted.clear();
    weighted.extend_from_slice(heat);
    let mut between = vec![0.0; columns];
    for (y, line) in weighted.chunks_exact_mut(CELL * columns).enumerate() {
        let (upper, lower, share) = neighbours(y, rows);
        let (upper, lower) = (&reliability[upper * columns..][..columns], &reliability[lower * columns..][..columns]);
        for ((between, a), b) in between.iter_mut().zip(upper).zip(lower) {
            *between = a + (b - a) * share;
        }
        // Half a cell at either end lies outside the outermost centres.
        let (first, rest) = line.split_at_mut(CELL / 2);
        let (inner, last) = rest.split_at_mut((columns - 1) * CELL);
        first.iter_mut().for_each(|pixel| *pixel *= between[0]);
        last.iter_mut().for_each(|pixel| *pixel *= between[columns - 1]);
        for (pixels, ends) in inner.as_chunks_mut::<CELL>().0.iter_mut().zip(between.windows(2)) {
            for (k, pixel) in pixels.iter_mut().enumerate() {
                *pixel *= ends[0] + (ends[1] - ends[0]) * ((k as f32 + 0.5) / CELL as f32);
            }
        }
    }
}

/// The two cells around pixel `y`, and how far it is from the first to the second.
fn neighbours(y: usize, rows: usize) -> (usize, usize, f32) {
    let at = ((y as f32 + 0.5) / CELL as f32 - 0.5).clamp(0.0, (rows - 1) as f32);
    let first = at as usize;
    (first, (first + 1).min(rows - 1), at - first as f32)
}

/// Bilinear value of a map of `columns` x `rows` cells of `cell` pixels, at a pixel of the image.
#[must_use]
pub fn sample(map: &[f32], columns: usize, rows: usize, cell: f32, x: f32, y: f32) -> f32 {
    let place = |v: f32, n: usize| ((v + 0.5) / cell - 0.5).clamp(0.0, (n - 1) as f32);
    let (x, y) = (place(x, columns), place(y, rows));
    let (x0, y0) = (x as usize, y as usize);
    let (x1, y1) = ((x0 + 1).min(columns - 1), (y0 + 1).min(rows - 1));
    let (fx, fy) = (x - x0 as f32, y - y0 as f32);
    let mix = |a: f32, b: f32, f: f32| a + (b - a) * f;
    let line = |y: usize| mix(map[y * columns + x0], map[y * columns + x1], fx);
    mix(line(y0), line(y1), fy)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_exponential_is_one() {
        for i in -8700..=8700 {
            let x = i as f32 * 0.01;
            let (ours, exact) = (f64::from(exp(x)), f64::from(x).exp());
            assert!((ours / exact - 1.0).abs() < 4e-6, "e^{x} is {exact}, not {ours}");
        }
        assert!(exp(-1e30) < 1e-37 && exp(f32::NEG_INFINITY) < 1e-37);
    }

    #[test]
    fn a_cell_is_a_softmax_and_its_pixels_lie_row_by_row() {
        let (columns, rows) = (3, 2);
        let logits: Vec<f32> = (0..LOGITS * 6).map(|i| ((i * 7919) % 101) as f32 * 0.1 - 5.0).collect();
        let mut heat = Vec::new();
        heat_from_logits(&logits, columns, rows, &mut heat);
        let (cell_x, cell_y) = (2, 1);
        let of = |channel: usize| logits[channel * 6 + cell_y * columns + cell_x].exp();
        let sum: f32 = (0..LOGITS).map(of).sum();
        for (i, j) in [(0, 0), (3, 5), (7, 7)] {
            let pixel = heat[(8 * cell_y + i) * 8 * columns + 8 * cell_x + j];
            assert!((pixel - of(8 * i + j) / sum).abs() < 1e-6);
        }
    }

    #[test]
    fn reliability_is_interpolated_between_the_centres_of_cells() {
        let (columns, rows) = (4, 3);
        let reliability: Vec<f32> = (0..12).map(|i| (i % 5) as f32 * 0.2).collect();
        let mut weighted = Vec::new();
        weigh(&vec![2.0; 64 * 12], &reliability, columns, rows, &mut weighted);
        for (x, y) in [(0, 0), (3, 3), (4, 4), (17, 9), (31, 23), (12, 20)] {
            let expected = 2.0 * sample(&reliability, columns, rows, 8.0, x as f32, y as f32);
            assert!((weighted[y * 32 + x] - expected).abs() < 1e-5, "({x}, {y})");
        }
        assert!((weighted[0] - 2.0 * reliability[0]).abs() < 1e-6);
    }
}
