//! Keeps the body from driving into what its scanner sees.
//!
//! The body is a disc. The corridor it would sweep with the velocity wanted, straight or along an arc, is searched for the
//! nearest return; the speed is scaled down as that comes near and is zero at the stop distance. A scan that is old or
//! blind counts as a wall. Turning in place stays allowed: a disc sweeps nothing, and it is how a robot gets free.

use core::time::Duration;

use homing_core::{LaserScan, Stamp};

use crate::limits::Velocity;

/// Distances of the monitor.
#[derive(Copy, Clone, Debug, PartialEq)]
pub struct CollisionConfig {
    /// Radius of the disc that holds the body, metres.
    pub radius_m: f64,
    /// Added to the radius at the sides, metres.
    pub side_margin_m: f64,
    /// Nearer than this ahead of the hull the body stops, metres.
    pub stop_m: f64,
    /// Nearer than this ahead of the hull it slows down, metres.
    pub slow_m: f64,
    /// An older scan counts as blind.
    pub age_max: Duration,
}

impl CollisionConfig {
    /// Stop 0.1 m ahead of the hull, slow from 0.4 m, 2 cm at the sides, scans up to 0.5 s old.
    #[must_use]
    pub fn new(radius_m: f64) -> Self {
        Self { radius_m, side_margin_m: 0.02, stop_m: 0.1, slow_m: 0.4, age_max: Duration::from_millis(500) }
    }
}

/// What the monitor made of a wish.
#[derive(Copy, Clone, Debug, PartialEq)]
pub enum Passage {
    /// Nothing in the way.
    Free,
    /// Slowed: something is this far ahead of the hull, metres.
    Slowed {
        /// Metres of travel until the hull would touch.
        ahead_m: f64,
    },
    /// Not a step further that way.
    Stopped {
        /// Metres of travel until the hull would touch.
        ahead_m: f64,
    },
    /// It cannot be told what is there: no scan, an old one, or one that saw nothing in the direction of travel.
    Blind,
}

/// Watches the scans.
#[derive(Clone, Debug)]
pub struct CollisionMonitor {
    config: CollisionConfig,
    scan: Option<Seen>,
    malformed: u64,
}

#[derive(Clone, Debug)]
struct Seen {
    stamp: Stamp,
    returns_m: Vec<(f64, f64)>,
    ahead: bool,
    behind: bool,
}

// More rays than any planar scanner has: a longer scan is malformed.
const RAYS_MAX: usize = 16_384;
// The direction of travel is judged by the rays within this angle of it, of which this share must have worked.
const SECTOR_RAD: f64 = 0.5;
const SECTOR_SHARE: f64 = 0.5;
// Slowest share of a speed in the slow zone: without it the stop distance is crept up to for seconds.
const CRAWL_SHARE: f64 = 0.2;
// Arcs wider than this are straight, metres.
const RADIUS_STRAIGHT_M: f64 = 100.0;

impl CollisionMonitor {
    /// Blind until the first scan.
    #[must_use]
    pub fn new(config: CollisionConfig) -> Self {
        Self { config, scan: None, malformed: 0 }
    }

    /// Takes a scan that arrived at `now`. One that is malformed, older than the last or stamped ahead of the clock is
    /// dropped and counted.
    pub fn sense(&mut self, now: Stamp, scan: &LaserScan) {
        let in_order = self.scan.as_ref().is_none_or(|last| last.stamp <= scan.stamp);
        if !in_order || scan.stamp > now.after(Duration::from_millis(50)) || !is_well_formed(scan) {
            self.malformed += 1;
            return;
        }
        self.scan = Some(Seen {
            stamp: scan.stamp,
            returns_m: returns(scan),
            ahead: sees(scan, 0.0),
            behind: sees(scan, core::f64::consts::PI),
        });
    }

    /// Scans dropped so far.
    #[must_use]
    pub fn malformed(&self) -> u64 {
        self.malformed
    }

    /// The part of `wanted` that may be driven, and why.
    #[must_use]
    pub fn limit(&self, now: Stamp, wanted: Velocity) -> (Velocity, Passage) {
        if wanted.linear_m_s == 0.0 {
            return (wanted, Passage::Free);
        }
        let turn_only = Velocity { linear_m_s: 0.0, ..wanted };
        let Some(seen) = self.usable(now, wanted) else { return (turn_only, Passage::Blind) };
        let radius_m = self.config.radius_m + self.config.side_margin_m;
        let nearest =
            seen.returns_m.iter().filter_map(|&p| travel_to_touch(p, wanted, radius_m)).fold(f64::MAX, f64::min);
        // The body may have driven towards it since the scan was taken.
        let ahead_m = nearest - wanted.linear_m_s.abs() * now.since(seen.stamp).as_secs_f64();
        let room = (ahead_m - self.config.stop_m) / (self.config.slow_m - self.config.stop_m).max(1e-6);
        if room <= 0.0 {
            (turn_only, Passage::Stopped { ahead_m })
        } else if room < 1.0 {
            let room = room.max(CRAWL_SHARE);
            let slowed = Velocity { linear_m_s: wanted.linear_m_s * room, angular_rad_s: wanted.angular_rad_s * room };
            (slowed, Passage::Slowed { ahead_m })
        } else {
            (wanted, Passage::Free)
        }
    }

    fn usable(&self, now: Stamp, wanted: Velocity) -> Option<&Seen> {
        let seen = self.scan.as_ref()?;
        let fresh = now.since(seen.stamp) <= self.config.age_max;
        let looks_there = if wanted.linear_m_s > 0.0 { seen.ahead } else { seen.behind };
        (fresh && looks_there).then_some(seen)
    }
}

fn is_well_formed(scan: &LaserScan) -> bool {
    let angles = scan.angle_min_rad.is_finite() && scan.angle_increment_rad.is_finite();
    let ranges = scan.range_min_m >= 0.0 && scan.range_max_m > scan.range_min_m;
    angles && ranges && !scan.ranges_m.is_empty() && scan.ranges_m.len() <= RAYS_MAX
}

fn angle_of(scan: &LaserScan, ray: usize) -> f64 {
    scan.angle_min_rad + ray as f64 * scan.angle_increment_rad
}

// Where something was hit, base frame, metres (x, y).
fn returns(scan: &LaserScan) -> Vec<(f64, f64)> {
    let hit = |range: f64| range >= scan.range_min_m && range <= scan.range_max_m;
    let rays = scan.ranges_m.iter().map(|&r| f64::from(r)).enumerate().filter(|&(_, r)| hit(r));
    rays.map(|(ray, r)| {
        let (sin, cos) = nalgebra::ComplexField::sin_cos(angle_of(scan, ray));
        (r * cos, r * sin)
    })
    .collect()
}

// True if enough rays in that direction say something: a distance, or that nothing is within range.
fn sees(scan: &LaserScan, direction_rad: f64) -> bool {
    let near = |ray: &usize| homing_core::wrap_angle(angle_of(scan, *ray) - direction_rad).abs() <= SECTOR_RAD;
    let sector: Vec<usize> = (0..scan.ranges_m.len()).filter(near).collect();
    let works = sector.iter().filter(|&&ray| f64::from(scan.ranges_m[ray]) >= scan.range_min_m).count();
    !sector.is_empty() && works as f64 >= SECTOR_SHARE * sector.len() as f64
}

/// How far the centre of a disc of `radius_m` travels along the path of `velocity` until it touches the point `p`
/// (base frame, metres); zero if it touches already and moves closer, `None` if it never touches within half a circle.
fn travel_to_touch(p: (f64, f64), velocity: Velocity, radius_m: f64) -> Option<f64> {
    // Driving backwards is driving forwards in the mirrored world: x and the sense of turning change sign.
    let forward = velocity.linear_m_s.signum();
    let (x, y) = (p.0 * forward, p.1);
    let turn_rad_s = velocity.angular_rad_s * forward;
    let arc_radius_m = velocity.linear_m_s.abs() / turn_rad_s.abs().max(1e-9);
    if arc_radius_m > RADIUS_STRAIGHT_M {
        return (x > 0.0 && y.abs() < radius_m).then(|| (x - (radius_m * radius_m - y * y).sqrt()).max(0.0));
    }
    // Mirror right turns to left turns: the arc's centre is at (0, arc_radius).
    let y = y * turn_rad_s.signum();
    let from_centre = (x, y - arc_radius_m);
    let d = (from_centre.0 * from_centre.0 + from_centre.1 * from_centre.1).sqrt();
    if (d - arc_radius_m).abs() >= radius_m {
        return None;
    }
    if d < 1e-9 {
        return Some(0.0);
    }
    let cos_touch = (arc_radius_m * arc_radius_m + d * d - radius_m * radius_m) / (2.0 * arc_radius_m * d);
    let before = nalgebra::ComplexField::acos(cos_touch.clamp(-1.0, 1.0));
    let at = nalgebra::RealField::atan2(from_centre.0, -from_centre.1);
    (at > 0.0).then(|| ((at - before) * arc_radius_m).max(0.0))
}

#[cfg(test)]
mod tests {
    use super::*;

    const RADIUS_M: f64 = 0.2;

    fn ms(t: u64) -> Stamp {
        Stamp(t * 1_000_000)
    }

    // A full circle of one-degree rays, all at infinity.
    fn open(stamp: Stamp) -> LaserScan {
        LaserScan {
            stamp,
            angle_min_rad: -core::f64::consts::PI,
            angle_increment_rad: 1.0_f64.to_radians(),
            range_min_m: 0.05,
            range_max_m: 10.0,
            ranges_m: vec![f32::INFINITY; 360],
        }
    }

    fn with_point(bearing_deg: i32, range_m: f32) -> LaserScan {
        let mut scan = open(ms(1000));
        scan.ranges_m[(bearing_deg + 180) as usize] = range_m;
        scan
    }

    fn limit(scan: &LaserScan, linear_m_s: f64, angular_rad_s: f64) -> (Velocity, Passage) {
        let mut monitor = CollisionMonitor::new(CollisionConfig::new(RADIUS_M));
        monitor.sense(ms(1000), scan);
        monitor.limit(ms(1000), Velocity { linear_m_s, angular_rad_s })
    }

    #[test]
    fn an_open_room_changes_nothing() {
        let (v, passage) = limit(&open(ms(1000)), 0.5, 0.3);
        assert_eq!((v, passage), (Velocity { linear_m_s: 0.5, angular_rad_s: 0.3 }, Passage::Free));
    }

    #[test]
    fn slows_and_stops_before_what_is_ahead() {
        assert_eq!(limit(&with_point(0, 0.9), 0.5, 0.0).1, Passage::Free);
        let (v, _) = limit(&with_point(0, 0.47), 0.5, 0.0);
        assert!((v.linear_m_s - 0.25).abs() < 1e-6, "half the slow zone is left, so half the speed: {v:?}");
        let (v, passage) = limit(&with_point(0, 0.31), 0.5, 0.2);
        assert!(matches!(passage, Passage::Stopped { .. }));
        assert_eq!(v, Velocity { linear_m_s: 0.0, angular_rad_s: 0.2 }, "turning in place stays allowed");
    }

    #[test]
    fn what_is_beside_or_behind_does_not_stop() {
        assert_eq!(limit(&with_point(90, 0.23), 0.5, 0.0).1, Passage::Free);
        assert_eq!(limit(&with_point(179, 0.21), 0.5, 0.0).1, Passage::Free);
        assert!(matches!(limit(&with_point(179, 0.25), -0.2, 0.0).1, Passage::Stopped { .. }));
    }

    #[test]
    fn follows_the_arc() {
        // Radius of the arc 0.5 m to the left: the quarter circle ends at (0.5, 0.5).
        let there = with_point(45, 0.707);
        assert!(matches!(limit(&there, 0.25, 0.5).1, Passage::Free), "half a metre of travel is left");
        let near = with_point(30, 0.40);
        assert!(matches!(limit(&near, 0.25, 0.5).1, Passage::Stopped { .. } | Passage::Slowed { .. }));
        assert_eq!(limit(&near, 0.25, -0.5).1, Passage::Free, "the right turn leaves it behind");
        let straight = limit(&with_point(0, 0.6), 0.25, 1e-6).1;
        assert!(matches!(straight, Passage::Slowed { .. }), "a wide arc is a straight line: {straight:?}");
    }

    #[test]
    fn blind_means_stop() {
        let forward = Velocity { linear_m_s: 0.5, angular_rad_s: 0.0 };
        let mut monitor = CollisionMonitor::new(CollisionConfig::new(RADIUS_M));
        assert_eq!(monitor.limit(ms(0), forward), (Velocity::ZERO, Passage::Blind), "no scan yet");
        monitor.sense(ms(1000), &open(ms(1000)));
        assert_eq!(monitor.limit(ms(1500), forward).1, Passage::Free);
        assert_eq!(monitor.limit(ms(1501), forward).1, Passage::Blind, "the scan is old");
        for invalid in [f32::NAN, 0.0, 0.01, -1.0] {
            let scan = LaserScan { ranges_m: vec![invalid; 360], stamp: ms(2000), ..open(ms(2000)) };
            monitor.sense(ms(2000), &scan);
            assert_eq!(monitor.limit(ms(2000), forward).1, Passage::Blind, "all rays {invalid}");
        }
        assert_eq!(monitor.malformed(), 0);
    }

    #[test]
    fn malformed_scans_are_dropped_and_counted() {
        let mut monitor = CollisionMonitor::new(CollisionConfig::new(RADIUS_M));
        monitor.sense(ms(1000), &LaserScan { angle_increment_rad: f64::NAN, ..open(ms(1000)) });
        monitor.sense(ms(1000), &LaserScan { ranges_m: Vec::new(), ..open(ms(1000)) });
        monitor.sense(ms(1000), &LaserScan { ranges_m: vec![1.0; 20_000], ..open(ms(1000)) });
        monitor.sense(ms(1000), &open(ms(9000)));
        assert_eq!(monitor.malformed(), 4);
        let forward = Velocity { linear_m_s: 0.5, angular_rad_s: 0.0 };
        assert_eq!(monitor.limit(ms(1000), forward).1, Passage::Blind);
    }
}
