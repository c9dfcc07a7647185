//! Descriptors at keypoints, from a dense map of them.

use homing_core::Keypoint;

/// A dense map of descriptors as networks give it: one plane of `columns` x `rows` cells per dimension.
#[derive(Copy, Clone, Debug)]
pub struct DenseMap<'a> {
    /// `dimension` planes, each row-major.
    pub planes: &'a [f32],
    /// Length of a descriptor.
    pub dimension: usize,
    /// Cells along a row.
    pub columns: usize,
    /// Rows of cells.
    pub rows: usize,
    /// Side of a cell, pixels of the input.
    pub cell: f32,
}

/// Unit descriptors at places of the input, each a bilinear mix of four cells; n x `dimension`, row-major. A map that is all
/// zero somewhere gives zeros there, which match nothing.
///
/// The four are brought to unit length before they are mixed, so that no loud cell outvotes its neighbours.
#[must_use]
pub fn describe(map: &DenseMap<'_>, places: &[Keypoint]) -> Vec<f32> {
    // Neighbouring cells of one plane lie together, the dimensions of one cell lie far apart: where most cells are asked for,
    // turning the map over once is cheaper.
    let cells = map.columns * map.rows;
    let mut described = vec![0.0; places.len() * map.dimension];
    if cells <= 8 * places.len().max(600) {
        let turned = unit_cells(map);
        let cell =
            |index: usize, into: &mut [f32]| into.copy_from_slice(&turned[index * map.dimension..][..into.len()]);
        fill(map, places, &mut described, cell);
    } else {
        let cell = |index: usize, into: &mut [f32]| {
            for (d, value) in into.iter_mut().enumerate() {
                *value = map.planes[d * cells + index];
            }
            normalise(into);
        };
        fill(map, places, &mut described, cell);
    }
    described
}

fn fill(map: &DenseMap<'_>, places: &[Keypoint], described: &mut [f32], cell: impl Fn(usize, &mut [f32])) {
    let mut corner = vec![0.0; map.dimension];
    for (place, descriptor) in places.iter().zip(described.chunks_exact_mut(map.dimension)) {
        for (index, weight) in corners(map, place) {
            if weight > 0.0 {
                cell(index, &mut corner);
                for (sum, value) in descriptor.iter_mut().zip(&corner) {
                    *sum += weight * value;
                }
            }
        }
        normalise(descriptor);
    }
}

/// The four cells around a place and their weights.
fn corners(map: &DenseMap<'_>, place: &Keypoint) -> [(usize, f32); 4] {
    let at = |v: f32, n: usize| ((v + 0.5) / map.cell - 0.5).clamp(0.0, (n - 1) as f32);
    let (x, y) = (at(place.x_px, map.columns), at(place.y_px, map.rows));
    let (x0, y0) = (x as usize, y as usize);
    let (x1, y1) = ((x0 + 1).min(map.columns - 1), (y0 + 1).min(map.rows - 1));
    let (fx, fy) = (x - x0 as f32, y - y0 as f32);
    let index = |x: usize, y: usize| y * map.columns + x;
    [
        (index(x0, y0), (1.0 - fx) * (1.0 - fy)),
        (index(x1, y0), fx * (1.0 - fy)),
        (index(x0, y1), (1.0 - fx) * fy),
        (index(x1, y1), fx * fy),
    ]
}

/// Cells one after the other, each of unit length: cells x `dimension`.
fn unit_cells(map: &DenseMap<'_>) -> Vec<f32> {
    /// Cells turned over at a time: 64 planes' worth of them stays in the first cache.
    const BLOCK: usize = 64;
    let (cells, dimension) = (map.columns * map.rows, map.dimension);
    let mut turned = vec![0.0; cells * dimension];
    for (block, out) in turned.chunks_mut(BLOCK * dimension).enumerate() {
        for d in 0..dimension {
            let plane = &map.planes[d * cells + block * BLOCK..(d + 1) * cells];
            for (descriptor, &value) in out.chunks_exact_mut(dimension).zip(plane) {
                descriptor[d] = value;
            }
        }
        out.chunks_exact_mut(dimension).for_each(normalise);
    }
    turned
}

/// Brings a vector to length 1; zeros stay, and what is not finite becomes zeros.
pub fn normalise(vector: &mut [f32]) {
    let mut sums = [0.0_f32; 8];
    let (chunks, rest) = vector.as_chunks::<8>();
    for chunk in chunks {
        for (sum, x) in sums.iter_mut().zip(chunk) {
            *sum += x * x;
        }
    }
    let squared = sums.iter().sum::<f32>() + rest.iter().map(|x| x * x).sum::<f32>();
    if squared.is_finite() {
        let inverse = if squared > 1e-24 { 1.0 / squared.sqrt() } else { 0.0 };
        vector.iter_mut().for_each(|x| *x *= inverse);
    } else {
        vector.fill(0.0);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn at(x_px: f32, y_px: f32) -> Keypoint {
        Keypoint { x_px, y_px, score: 1.0 }
    }

    fn planes(dimension: usize, cells: usize) -> Vec<f32> {
        (0..dimension * cells).map(|i| ((i * 7919 + 13) % 1009) as f32 - 500.0).collect()
    }

    #[test]
    fn descriptors_are_mixed_from_the_cells_around() {
        let planes = planes(64, 20 * 15);
        let map = DenseMap { planes: &planes, dimension: 64, columns: 20, rows: 15, cell: 8.0 };
        let cell = |x: usize, y: usize| {
            let mut cell: Vec<f32> = (0..64).map(|d| planes[d * 300 + y * 20 + x]).collect();
            normalise(&mut cell);
            cell
        };
        let described = describe(&map, &[at(3.5, 3.5), at(8.0 * 5.0 + 3.5, 8.0 * 7.0 + 7.5), at(-3.0, 200.0)]);
        assert_eq!(described[..64], cell(0, 0));
        let mut half: Vec<f32> = cell(5, 7).iter().zip(cell(5, 8)).map(|(a, b)| 0.5 * (a + b)).collect();
        normalise(&mut half);
        assert!(described[64..128].iter().zip(half).all(|(a, b)| (a - b).abs() < 1e-6));
        assert_eq!(described[128..], cell(0, 14), "outside, the nearest cell counts");
    }

    #[test]
    fn few_places_on_a_large_map_get_the_same_descriptors() {
        let planes = planes(16, 100 * 90);
        let map = DenseMap { planes: &planes, dimension: 16, columns: 100, rows: 90, cell: 1.0 };
        let places = [at(17.25, 80.5), at(99.0, 0.0)];
        let many: Vec<Keypoint> = places.iter().copied().cycle().take(2000).collect();
        assert_eq!(describe(&map, &places), describe(&map, &many)[..32]);
    }

    #[test]
    fn what_is_no_direction_becomes_zeros() {
        let mut zero = vec![0.0; 10];
        normalise(&mut zero);
        let mut bad = vec![f32::NAN, 1.0, f32::INFINITY];
        normalise(&mut bad);
        assert!(zero.iter().chain(&bad).all(|x| *x == 0.0));
    }
}
