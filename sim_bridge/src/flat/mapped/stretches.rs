//! Straight pieces of wall, each in one room.

use super::contour::{Point, distance};
use super::regions::Regions;

/// Rooms are looked up this often along a wall, metres.
const SAMPLE_M: f64 = 0.1;
/// How far before a wall its room is looked up, metres.
const BEFORE_M: f64 = 0.2;
/// A wall has the outside behind it if no navigable place lies within so much of it, metres.
const OUTSIDE_M: f64 = 1.0;
/// What is shorter than this has the looks of what it continues, metres.
const SHORT_M: f64 = 0.4;

/// A straight piece of wall; who walks from its beginning to its end has the room to the left.
#[derive(Copy, Clone, Debug, PartialEq)]
pub(super) struct Stretch {
    /// Where it begins, world frame, metres.
    pub from: Point,
    /// Where it ends.
    pub to: Point,
    /// Its room.
    pub room: u32,
    /// Nothing but the outside lies behind it.
    pub outer: bool,
    /// Metres along the whole outline at its beginning.
    pub along_m: f64,
}

impl Stretch {
    /// Metres.
    pub fn length_m(&self) -> f64 {
        distance(self.from, self.to)
    }

    /// Direction from beginning to end, radians.
    pub fn yaw_rad(&self) -> f64 {
        libm::atan2(self.to.1 - self.from.1, self.to.0 - self.from.0)
    }
}

/// Cuts an outline into stretches: at its corners, and where one room ends and the next begins.
pub(super) fn stretches(corners: &[Point], regions: &Regions) -> Vec<Stretch> {
    let mut all = Vec::with_capacity(corners.len());
    let mut along_m = 0.0;
    let mut room = 0;
    for (k, &from) in corners.iter().enumerate() {
        let to = corners[(k + 1) % corners.len()];
        let length = distance(from, to);
        if length < 1e-9 {
            continue;
        }
        for (share0, share1, found) in runs(from, to, room, regions) {
            let at = |s: f64| (from.0 + s * (to.0 - from.0), from.1 + s * (to.1 - from.1));
            let (a, b) = (at(share0), if share1 >= 1.0 { to } else { at(share1) });
            room = found;
            let outer = is_outer(a, b, regions);
            all.push(Stretch { from: a, to: b, room, outer, along_m: along_m + share0 * length });
        }
        along_m += length;
    }
    all
}

/// Shares of a wall with the room each lies in; `before` is the room of the wall before it.
fn runs(from: Point, to: Point, before: u32, regions: &Regions) -> Vec<(f64, f64, u32)> {
    let length = distance(from, to);
    let n = (length / SAMPLE_M).ceil().max(1.0) as u32;
    let left = ((from.1 - to.1) / length, (to.0 - from.0) / length);
    let mut runs: Vec<(f64, f64, u32)> = Vec::new();
    for k in 0..n {
        let s = (f64::from(k) + 0.5) / f64::from(n);
        let p = (from.0 + s * (to.0 - from.0) + BEFORE_M * left.0, from.1 + s * (to.1 - from.1) + BEFORE_M * left.1);
        let room = regions.at(p).or_else(|| runs.last().map(|r| r.2)).unwrap_or(before);
        let end = f64::from(k + 1) / f64::from(n);
        match runs.last_mut() {
            Some(run) if run.2 == room || (run.1 - run.0) * length < SHORT_M => run.1 = end,
            Some(_) if (1.0 - end) * length < SHORT_M => {
                if let Some(run) = runs.last_mut() {
                    run.1 = 1.0;
                }
                break;
            }
            _ => runs.push((f64::from(k) / f64::from(n), end, room)),
        }
    }
    runs
}

fn is_outer(a: Point, b: Point, regions: &Regions) -> bool {
    let length = distance(a, b).max(1e-9);
    let right = ((b.1 - a.1) / length, (a.0 - b.0) / length);
    let behind = |s: f64, d: f64| {
        regions.clearance_m((a.0 + s * (b.0 - a.0) + d * right.0, a.1 + s * (b.1 - a.1) + d * right.1)) > 0.0
    };
    let steps = (OUTSIDE_M / 0.1) as u32;
    ![0.1, 0.5, 0.9].iter().any(|s| (1..=steps).any(|k| behind(*s, 0.1 * f64::from(k))))
}

#[cfg(test)]
mod tests {
    use homing_core::GridGeometry;

    use super::super::map::NavMap;
    use super::*;

    #[test]
    fn a_wall_along_two_rooms_is_cut_between_them() {
        let rows = ["......#......", "......#......", ".............", "......#......", "......#......"];
        let geometry = GridGeometry { width: 13, height: 5, resolution_m: 0.5, origin_x_m: 0.0, origin_y_m: 0.0 };
        let navigable = rows.iter().flat_map(|r| r.bytes().map(|b| b == b'.')).collect();
        let map = NavMap { name: "drawn".into(), geometry, navigable, floor_y_m: 0.0 };
        let regions = Regions::of(&map);
        // The wall below both rooms, and the near side of the wall between them.
        let all = stretches(&[(0.0, -0.1), (6.5, -0.1), (6.5, 2.6), (0.0, 2.6)], &regions);
        let below: Vec<&Stretch> = all.iter().filter(|s| s.from.1 < 0.0 && s.to.1 < 0.0).collect();
        assert_eq!(below.len(), 2, "{all:?}");
        assert!((below[0].to.0 - 3.25).abs() < 0.3 && below[0].room != below[1].room);
        assert!(below.iter().all(|s| s.outer));
        assert!((below[1].along_m - below[0].length_m()).abs() < 1e-9);
        let between = stretches(&[(3.0, 0.0), (3.0, 0.9), (2.0, 0.5)], &regions);
        assert!(!between[0].outer, "the other room lies behind it");
    }
}
