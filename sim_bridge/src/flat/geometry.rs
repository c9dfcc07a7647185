//! Plane figures of the floor plan: rectangles, sides, and the local frames in which walls and furniture are described.

/// An axis-aligned rectangle on the floor, world frame, metres.
#[derive(Copy, Clone, Debug, PartialEq)]
pub struct Rect {
    /// Smallest x.
    pub x0: f64,
    /// Smallest y.
    pub y0: f64,
    /// Largest x.
    pub x1: f64,
    /// Largest y.
    pub y1: f64,
}

impl Rect {
    /// From its corners, in metres.
    #[must_use]
    pub fn new(x0: f64, y0: f64, x1: f64, y1: f64) -> Self {
        Self { x0, y0, x1, y1 }
    }

    /// Extent along x, metres.
    #[must_use]
    pub fn width(&self) -> f64 {
        self.x1 - self.x0
    }

    /// Extent along y, metres.
    #[must_use]
    pub fn depth(&self) -> f64 {
        self.y1 - self.y0
    }

    /// Square metres.
    #[must_use]
    pub fn area(&self) -> f64 {
        self.width() * self.depth()
    }

    /// Centre (x, y), metres.
    #[must_use]
    pub fn centre(&self) -> (f64, f64) {
        (0.5 * (self.x0 + self.x1), 0.5 * (self.y0 + self.y1))
    }

    /// Moved outwards on all sides by `by_m` (inwards if negative).
    #[must_use]
    pub fn grown(&self, by_m: f64) -> Self {
        Self::new(self.x0 - by_m, self.y0 - by_m, self.x1 + by_m, self.y1 + by_m)
    }

    /// True if the point lies inside or on the border.
    #[must_use]
    pub fn contains(&self, x_m: f64, y_m: f64) -> bool {
        x_m >= self.x0 && x_m <= self.x1 && y_m >= self.y0 && y_m <= self.y1
    }

    /// True if `other` lies inside or on the border.
    #[must_use]
    pub fn holds(&self, other: &Rect) -> bool {
        self.contains(other.x0, other.y0) && self.contains(other.x1, other.y1)
    }

    /// True if the insides meet.
    #[must_use]
    pub fn overlaps(&self, other: &Rect) -> bool {
        self.x0 < other.x1 && other.x0 < self.x1 && self.y0 < other.y1 && other.y0 < self.y1
    }

    /// The wall frame of a side: origin at the wall's corner, x along the wall, y into the room.
    #[must_use]
    pub(super) fn side(&self, side: Side) -> Spot {
        match side {
            Side::South => Spot::new(self.x0, self.y0, 0),
            Side::East => Spot::new(self.x1, self.y0, 1),
            Side::North => Spot::new(self.x1, self.y1, 2),
            Side::West => Spot::new(self.x0, self.y1, 3),
        }
    }

    /// Length of a side, metres.
    #[must_use]
    pub(super) fn side_length(&self, side: Side) -> f64 {
        match side {
            Side::South | Side::North => self.width(),
            Side::East | Side::West => self.depth(),
        }
    }
}

/// A side of a rectangle, named like the points of the compass (y north, x east).
#[derive(Copy, Clone, Debug, PartialEq, Eq)]
pub enum Side {
    /// Smallest y.
    South,
    /// Largest x.
    East,
    /// Largest y.
    North,
    /// Smallest x.
    West,
}

impl Side {
    /// The four sides, counter-clockwise.
    pub const ALL: [Side; 4] = [Side::South, Side::East, Side::North, Side::West];

    /// The side across.
    #[must_use]
    pub fn opposite(self) -> Side {
        match self {
            Side::South => Side::North,
            Side::East => Side::West,
            Side::North => Side::South,
            Side::West => Side::East,
        }
    }
}

/// A local frame on the floor: origin and direction of its x axis, z up.
#[derive(Copy, Clone, Debug, PartialEq)]
pub(super) struct Spot {
    /// World frame, metres.
    pub x: f64,
    /// World frame, metres.
    pub y: f64,
    cos: f64,
    sin: f64,
}

impl Spot {
    /// Turned by a number of quarter turns to the left, exactly.
    pub fn new(x: f64, y: f64, quarters: usize) -> Self {
        let (cos, sin) = [(1.0, 0.0), (0.0, 1.0), (-1.0, 0.0), (0.0, -1.0)][quarters % 4];
        Self { x, y, cos, sin }
    }

    /// The same frame moved along its own axes, metres.
    pub fn shifted(&self, x: f64, y: f64) -> Self {
        let (wx, wy) = self.point(x, y);
        Self { x: wx, y: wy, ..*self }
    }

    /// The same frame turned left about its origin, radians.
    pub fn turned(&self, angle_rad: f64) -> Self {
        let (c, s) = (libm::cos(angle_rad), libm::sin(angle_rad));
        Self { cos: self.cos * c - self.sin * s, sin: self.sin * c + self.cos * s, ..*self }
    }

    /// A local point in the world.
    pub fn point(&self, x: f64, y: f64) -> (f64, f64) {
        (self.x + self.cos * x - self.sin * y, self.y + self.sin * x + self.cos * y)
    }

    /// A local direction in the world.
    pub fn direction(&self, x: f64, y: f64) -> (f64, f64) {
        (self.cos * x - self.sin * y, self.sin * x + self.cos * y)
    }

    /// A world point in this frame.
    pub fn local(&self, x: f64, y: f64) -> (f64, f64) {
        let (dx, dy) = (x - self.x, y - self.y);
        (self.cos * dx + self.sin * dy, self.cos * dy - self.sin * dx)
    }

    /// World rectangle around the local rectangle `x0..x1`, `y0..y1`.
    pub fn rect(&self, x: (f64, f64), y: (f64, f64)) -> Rect {
        let corners = [self.point(x.0, y.0), self.point(x.1, y.0), self.point(x.1, y.1), self.point(x.0, y.1)];
        corners.iter().fold(Rect::new(f64::MAX, f64::MAX, f64::MIN, f64::MIN), |r, c| {
            Rect::new(r.x0.min(c.0), r.y0.min(c.1), r.x1.max(c.0), r.y1.max(c.1))
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_wall_frame_points_into_the_room() {
        let room = Rect::new(1.0, 2.0, 4.0, 7.0);
        for side in Side::ALL {
            let wall = room.side(side);
            let inside = wall.point(0.5 * room.side_length(side), 0.1);
            assert!(room.contains(inside.0, inside.1), "{side:?}");
            let end = wall.point(room.side_length(side), 0.0);
            assert!(room.contains(end.0, end.1), "{side:?}");
            let back = wall.local(inside.0, inside.1);
            assert!((back.1 - 0.1).abs() < 1e-12);
        }
    }
}
