//! From a heat map to keypoints: local maxima, the strongest of them, their places between the pixels.

use homing_core::Keypoint;

/// Which maxima of a heat map become keypoints.
#[derive(Copy, Clone, Debug, PartialEq)]
pub struct PeakRule {
    /// A peak is the largest of the (2 radius + 1)^2 pixels around it.
    pub radius: usize,
    /// Smallest value of a peak.
    pub min: f32,
    /// Pixels along the edges of the map without peaks.
    pub border: usize,
}

/// A pixel of a heat map.
#[derive(Copy, Clone, Debug, PartialEq)]
pub struct Peak {
    /// Column.
    pub x: usize,
    /// Row.
    pub y: usize,
    /// Value.
    pub value: f32,
}

/// All peaks, row by row. Of a plateau the first pixel is the peak.
#[must_use]
pub fn peaks(map: &[f32], width: usize, height: usize, rule: &PeakRule) -> Vec<Peak> {
    let mut found = Vec::new();
    let inside = rule.border..width.saturating_sub(rule.border);
    for y in rule.border..height.saturating_sub(rule.border) {
        let line = &map[y * width..][..width];
        for x in inside.clone() {
            let value = line[x];
            // Also refuses a NaN. Few pixels pass, so what follows may be slow.
            if value > rule.min && is_peak(map, (width, height), (x, y), rule.radius) {
                found.push(Peak { x, y, value });
            }
        }
    }
    found
}

fn is_peak(map: &[f32], (width, height): (usize, usize), (x, y): (usize, usize), radius: usize) -> bool {
    let value = map[y * width + x];
    let columns = x.saturating_sub(radius)..(x + radius + 1).min(width);
    let mut rows = y.saturating_sub(radius)..(y + radius + 1).min(height);
    rows.all(|row| {
        let line = &map[row * width..][columns.clone()];
        // Of equal pixels the first is the peak: those before must be smaller, those after may be equal.
        let n_before = if row == y { x - columns.start } else { line.len() * usize::from(row < y) };
        let (before, after) = line.split_at(n_before);
        before.iter().all(|&v| v < value) && after.iter().all(|&v| v <= value)
    })
}

/// The `keypoints_max` strongest, strongest first; equals in the order in which they came.
pub fn keep_strongest(peaks: &mut Vec<Peak>, keypoints_max: usize) {
    let order = |a: &Peak, b: &Peak| b.value.total_cmp(&a.value).then(a.y.cmp(&b.y)).then(a.x.cmp(&b.x));
    if peaks.len() > keypoints_max && keypoints_max > 0 {
        peaks.select_nth_unstable_by(keypoints_max - 1, order);
    }
    peaks.truncate(keypoints_max);
    peaks.sort_unstable_by(order);
}

/// The top of the parabola through a peak and its neighbours, along either axis: at most half a pixel away.
#[must_use]
pub fn refined(map: &[f32], width: usize, height: usize, peak: &Peak) -> Keypoint {
    let at = |x: usize, y: usize| map[y * width + x];
    let (x, y) = (peak.x, peak.y);
    let mut keypoint = Keypoint { x_px: x as f32, y_px: y as f32, score: peak.value };
    if x > 0 && x + 1 < width {
        keypoint.x_px += top(at(x - 1, y), peak.value, at(x + 1, y));
    }
    if y > 0 && y + 1 < height {
        keypoint.y_px += top(at(x, y - 1), peak.value, at(x, y + 1));
    }
    keypoint
}

fn top(before: f32, at: f32, after: f32) -> f32 {
    let curvature = before - 2.0 * at + after;
    if curvature < 0.0 { (0.5 * (before - after) / curvature).clamp(-0.5, 0.5) } else { 0.0 }
}

#[cfg(test)]
mod tests {
    use super::*;

    const RULE: PeakRule = PeakRule { radius: 2, min: 0.1, border: 0 };

    fn bumps(width: usize, height: usize, centres: &[(f32, f32, f32)]) -> Vec<f32> {
        let value = |i: usize| {
            let (x, y) = ((i % width) as f32, (i / width) as f32);
            centres.iter().map(|(cx, cy, a)| a * (-((x - cx).powi(2) + (y - cy).powi(2)) / 4.0).exp()).sum()
        };
        (0..width * height).map(value).collect()
    }

    #[test]
    fn peaks_are_found_where_they_are_strongest_first() {
        let centres = [(10.3, 8.6, 0.5), (30.0, 20.25, 0.9), (0.0, 0.0, 0.7), (39.0, 29.0, 0.3)];
        let map = bumps(40, 30, &centres);
        let mut found = peaks(&map, 40, 30, &RULE);
        keep_strongest(&mut found, 100);
        let places: Vec<(usize, usize)> = found.iter().map(|p| (p.x, p.y)).collect();
        assert_eq!(places, [(30, 20), (0, 0), (10, 9), (39, 29)]);
        for (peak, (x, y, _)) in [(found[0], centres[1]), (found[2], centres[0])] {
            let keypoint = refined(&map, 40, 30, &peak);
            assert!((keypoint.x_px - x).abs() < 0.05 && (keypoint.y_px - y).abs() < 0.05, "{keypoint:?}");
        }
        keep_strongest(&mut found, 2);
        assert_eq!(found.len(), 2);
        assert_eq!(peaks(&map, 40, 30, &PeakRule { border: 4, ..RULE }).len(), 2);
        keep_strongest(&mut found, 0);
        assert!(found.is_empty());
    }

    #[test]
    fn a_plateau_has_one_peak_and_noise_none() {
        let mut map = vec![0.0; 400];
        (105..112).for_each(|i| map[i] = 0.5);
        assert_eq!(peaks(&map, 20, 20, &RULE).len(), 1);
        assert!(peaks(&vec![0.05; 400], 20, 20, &RULE).is_empty());
        assert!(peaks(&vec![f32::NAN; 400], 20, 20, &RULE).is_empty());
        assert!(peaks(&[], 0, 0, &RULE).is_empty());
    }

    #[test]
    fn peaks_are_apart() {
        let map: Vec<f32> = (0..64 * 64_u32).map(|i| f32::from((i.wrapping_mul(2_654_435_761) >> 16) as u16)).collect();
        let found = peaks(&map, 64, 64, &RULE);
        assert!(found.len() > 100);
        for (i, a) in found.iter().enumerate() {
            assert!(found[i + 1..].iter().all(|b| a.x.abs_diff(b.x) > 2 || a.y.abs_diff(b.y) > 2));
        }
    }
}
