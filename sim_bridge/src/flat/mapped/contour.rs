//! Outlines of cells as polygons: traced along cell borders, straightened, and cut into triangles.

use super::widen::Floor;

/// A point of the floor plan, world frame, metres.
pub(super) type Point = (f64, f64);

/// Steps along cell borders.
const STEPS: [(i64, i64); 4] = [(1, 0), (0, 1), (-1, 0), (0, -1)];

/// The borders of a floor as closed polygons with the floor to their left: around floors counter-clockwise, around what
/// stands in them clockwise. Straightened by at most `tolerance_m` metres.
pub(super) fn outlines(floor: &Floor, tolerance_m: f64) -> Vec<Vec<Point>> {
    let g = &floor.geometry;
    let metres =
        |(c, r): (i64, i64)| (g.origin_x_m + c as f64 * g.resolution_m, g.origin_y_m + r as f64 * g.resolution_m);
    let loops = trace(floor).into_iter().map(|corners| corners.into_iter().map(metres).collect::<Vec<Point>>());
    let whole = |corners: Vec<Point>| {
        let straight = straightened(&corners, tolerance_m);
        if straight.len() >= 3 { straight } else { around(&corners) }
    };
    loops.map(whole).collect()
}

/// The rectangle around an outline, in its own direction: for what is too small to be straightened.
fn around(corners: &[Point]) -> Vec<Point> {
    let (low, high) = corners.iter().fold(((f64::MAX, f64::MAX), (f64::MIN, f64::MIN)), |(l, h), c| {
        ((l.0.min(c.0), l.1.min(c.1)), (h.0.max(c.0), h.1.max(c.1)))
    });
    let mut rectangle = vec![low, (high.0, low.1), high, (low.0, high.1)];
    if signed_area(corners) < 0.0 {
        rectangle.reverse();
    }
    rectangle
}

/// Walks along all cell borders. Where two cells of floor touch at a corner, they hang together.
fn trace(floor: &Floor) -> Vec<Vec<(i64, i64)>> {
    let (width, height) = (floor.geometry.width as i64 + 1, floor.geometry.height as i64 + 1);
    let at = |(c, r): (i64, i64)| (r * width + c) as usize;
    let mut leaving = vec![0_u8; (width * height) as usize];
    for row in 0..height - 1 {
        for column in (0..width - 1).filter(|c| floor.is_open(*c, row)) {
            let starts = [(column, row), (column + 1, row), (column + 1, row + 1), (column, row + 1)];
            let beyond = [(0, -1), (1, 0), (0, 1), (-1, 0)];
            for (k, (start, (dc, dr))) in starts.into_iter().zip(beyond).enumerate() {
                if !floor.is_open(column + dc, row + dr) {
                    leaving[at(start)] |= 1 << k;
                }
            }
        }
    }
    let mut loops = Vec::new();
    for first in 0..leaving.len() {
        while leaving[first] != 0 {
            let start = (first as i64 % width, first as i64 / width);
            let mut corners = Vec::new();
            let (mut here, mut heading) = (start, leaving[first].trailing_zeros() as usize);
            loop {
                leaving[at(here)] &= !(1 << heading);
                here = (here.0 + STEPS[heading].0, here.1 + STEPS[heading].1);
                // Right first: that joins floors at corners.
                let turns = [(heading + 3) % 4, heading, (heading + 1) % 4];
                let Some(next) = turns.into_iter().find(|k| leaving[at(here)] & (1 << k) != 0) else { break };
                if next != heading {
                    corners.push(here);
                }
                heading = next;
            }
            corners.push(start);
            loops.push(corners);
        }
    }
    loops
}

/// Douglas and Peucker (1973) on a closed line, cut at two of its farthest corners.
fn straightened(corners: &[Point], tolerance_m: f64) -> Vec<Point> {
    let farthest = |from: Point| {
        let by = |i: &usize, j: &usize| distance(from, corners[*i]).total_cmp(&distance(from, corners[*j]));
        (0..corners.len()).max_by(by).unwrap_or(0)
    };
    let Some(&any) = corners.first() else { return Vec::new() };
    let first = farthest(any);
    let turned: Vec<Point> = corners[first..].iter().chain(&corners[..=first]).copied().collect();
    let second =
        turned.iter().enumerate().max_by(|a, b| distance(turned[0], *a.1).total_cmp(&distance(turned[0], *b.1)));
    let second = second.map_or(0, |(i, _)| i);
    let mut kept = vec![false; turned.len()];
    let mut stack = vec![(0, second), (second, turned.len() - 1)];
    while let Some((from, to)) = stack.pop() {
        (kept[from], kept[to]) = (true, true);
        let worst = (from + 1..to).max_by(|i, j| {
            off_line(turned[*i], turned[from], turned[to]).total_cmp(&off_line(turned[*j], turned[from], turned[to]))
        });
        if let Some(worst) = worst.filter(|w| off_line(turned[*w], turned[from], turned[to]) > tolerance_m) {
            stack.extend([(from, worst), (worst, to)]);
        }
    }
    let last = turned.len() - 1;
    (0..last).filter(|i| kept[*i]).map(|i| turned[i]).collect()
}

/// Distance of a point from a segment, metres.
fn off_line(p: Point, a: Point, b: Point) -> f64 {
    let (dx, dy) = (b.0 - a.0, b.1 - a.1);
    let squared = dx * dx + dy * dy;
    let along = if squared > 0.0 { (((p.0 - a.0) * dx + (p.1 - a.1) * dy) / squared).clamp(0.0, 1.0) } else { 0.0 };
    distance(p, (a.0 + along * dx, a.1 + along * dy))
}

/// Metres between two points.
pub(super) fn distance(a: Point, b: Point) -> f64 {
    libm::hypot(a.0 - b.0, a.1 - b.1)
}

/// Area of a polygon, square metres: positive counter-clockwise, negative clockwise.
pub(super) fn signed_area(corners: &[Point]) -> f64 {
    let next = corners.iter().cycle().skip(1);
    0.5 * corners.iter().zip(next).map(|(a, b)| a.0 * b.1 - b.0 * a.1).sum::<f64>()
}

/// A simple counter-clockwise polygon as triangles, by cutting ears (Meisters 1975). What cannot be cut is left out.
pub(super) fn triangulated(corners: &[Point]) -> Vec<[Point; 3]> {
    let mut left: Vec<Point> = corners.to_vec();
    let mut triangles = Vec::with_capacity(corners.len());
    while left.len() > 3 {
        let n = left.len();
        let ear = (0..n).find(|&i| {
            let t = [left[(i + n - 1) % n], left[i], left[(i + 1) % n]];
            turn(t[0], t[1], t[2]) > 1e-12 && !left.iter().any(|p| !t.contains(p) && holds(&t, *p))
        });
        let Some(i) =
            ear.or_else(|| (0..n).find(|&i| turn(left[(i + n - 1) % n], left[i], left[(i + 1) % n]).abs() <= 1e-12))
        else {
            return triangles;
        };
        triangles.push([left[(i + n - 1) % n], left[i], left[(i + 1) % n]]);
        left.remove(i);
    }
    triangles.extend(<[Point; 3]>::try_from(left).ok());
    triangles
}

/// Twice the area of a triangle, positive if it turns left.
fn turn(a: Point, b: Point, c: Point) -> f64 {
    (b.0 - a.0) * (c.1 - a.1) - (b.1 - a.1) * (c.0 - a.0)
}

fn holds(t: &[Point; 3], p: Point) -> bool {
    (0..3).all(|k| turn(t[k], t[(k + 1) % 3], p) >= 0.0)
}

#[cfg(test)]
mod tests {
    use homing_core::GridGeometry;

    use super::*;

    fn floor(rows: &[&str]) -> Floor {
        let geometry = GridGeometry {
            width: rows[0].len(),
            height: rows.len(),
            resolution_m: 1.0,
            origin_x_m: 0.0,
            origin_y_m: 0.0,
        };
        Floor { geometry, open: rows.iter().flat_map(|r| r.bytes().map(|b| b == b'.')).collect() }
    }

    #[test]
    fn a_room_with_a_pillar_has_two_outlines() {
        let loops = outlines(&floor(&["#####", "#...#", "#.#.#", "#...#", "#####"]), 0.1);
        let mut areas: Vec<f64> = loops.iter().map(|l| signed_area(l)).collect();
        areas.sort_by(f64::total_cmp);
        assert_eq!(areas, [-1.0, 9.0]);
        assert!(loops.iter().all(|l| l.len() == 4), "{loops:?}");
    }

    #[test]
    fn cells_that_touch_at_a_corner_are_one_floor() {
        let loops = outlines(&floor(&["####", "#.##", "##.#", "####"]), 0.1);
        assert_eq!(loops.len(), 1);
        assert!((signed_area(&loops[0]) - 2.0).abs() < 1e-12);
    }

    #[test]
    fn what_is_smaller_than_the_tolerance_is_not_lost() {
        let loops = outlines(&floor(&["#####", "#...#", "#.#.#", "#...#", "#####"]), 1.5);
        let areas: Vec<f64> = loops.iter().map(|l| signed_area(l)).collect();
        assert!(areas.contains(&-1.0), "{areas:?}");
    }

    #[test]
    fn a_staircase_becomes_a_slanting_wall() {
        let rows: Vec<String> = (0..20_usize)
            .map(|r| {
                (0..24_usize).map(|c| if c > 0 && c < 2 + r && r > 0 && r < 19 && c < 23 { '.' } else { '#' }).collect()
            })
            .collect();
        let rows: Vec<&str> = rows.iter().map(String::as_str).collect();
        let loops = outlines(&floor(&rows), 0.75);
        assert_eq!(loops.len(), 1);
        assert!(loops[0].len() <= 7, "{} corners", loops[0].len());
    }

    #[test]
    fn triangles_cover_a_polygon_with_a_dent() {
        let l = [(0.0, 0.0), (3.0, 0.0), (3.0, 1.0), (1.0, 1.0), (1.0, 2.0), (0.0, 2.0)];
        let triangles = triangulated(&l);
        let area: f64 = triangles.iter().map(|t| signed_area(t)).sum();
        assert_eq!((triangles.len(), area), (4, 4.0));
        assert!(triangles.iter().all(|t| signed_area(t) > 0.0));
    }
}
