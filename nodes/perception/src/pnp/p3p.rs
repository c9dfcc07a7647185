//! The minimal kernel: the camera's pose from three points and the rays they are seen along.
//!
//! With d_i the distance to point i along ray f_i, the law of cosines gives d_i^2 + d_j^2 - 2 d_i d_j (f_i . f_j) =
//! |X_i - X_j|^2 for the three pairs. Eliminating the right-hand sides leaves two conics in (d_0 : d_1 : d_2). A member
//! of their pencil with zero determinant is a pair of lines; each line meets another member in two points, so there are
//! up to four solutions (the approach of Persson and Nordberg, "Lambda Twist", ECCV 2018, and of Ding et al.,
//! "Revisiting the P3P Problem", CVPR 2023). One real root of the pencil's cubic is enough: where the conics meet in real
//! points, every real degenerate member is a pair of real lines.

use nalgebra::{ComplexField, Matrix3, Point3, Vector3};

use super::CameraPose;

/// Appends the poses (at most four) from which `points` (metres, any frame) lie along `rays` (unit, camera frame).
///
/// Points in line, rays that coincide and numbers that are not finite give none. Every pose appended is finite and sees
/// its points in front.
pub fn p3p(rays: &[Vector3<f64>; 3], points: &[Point3<f64>; 3], poses: &mut Vec<CameraPose>) {
    let Some(triangle) = Triangle::new(rays, points) else { return };
    let Some((lines, conic)) = triangle.line_pair() else { return };
    for line in lines {
        for ratio in meet(&line, &conic).into_iter().flatten() {
            if let Some(distances) = triangle.distances(&ratio) {
                poses.push(triangle.pose(&distances));
            }
        }
    }
}

/// Three points and their rays, ordered so that the side from point 1 to point 2 is the longest; it is the unit of
/// length of everything but `corner` and `inverse`.
struct Triangle {
    rays: [Vector3<f64>; 3],
    /// Cosines between the rays of the pairs (0, 1), (0, 2), (1, 2).
    cosines: [f64; 3],
    /// Squared sides (0, 1) and (0, 2).
    squares: [f64; 2],
    /// Longest side, metres.
    unit_m: f64,
    /// Point 0, metres.
    corner: Vector3<f64>,
    /// Rows of the inverse of [X_0 - X_1, X_0 - X_2, their cross product], 1/m and 1/m^2.
    inverse: [Vector3<f64>; 3],
}

impl Triangle {
    fn new(rays: &[Vector3<f64>; 3], points: &[Point3<f64>; 3]) -> Option<Self> {
        let square = |i: usize, j: usize| (points[i] - points[j]).norm_squared();
        let (s01, s02, s12) = (square(0, 1), square(0, 2), square(1, 2));
        let [i, j, k] = if s12 >= s01 && s12 >= s02 {
            [0, 1, 2]
        } else if s02 >= s01 {
            [1, 0, 2]
        } else {
            [2, 0, 1]
        };
        let sides = [points[i] - points[j], points[i] - points[k]];
        let normal = sides[0].cross(&sides[1]);
        let (area, longest) = (normal.norm_squared(), s01.max(s02).max(s12));
        // Twice the area against the longest side squared: below 1e-4 the plane through the points is undefined. Also
        // refuses a NaN.
        if !(area > 1e-8 * longest * longest && area.is_finite()) {
            return None;
        }
        let rays = [rays[i], rays[j], rays[k]];
        Some(Self {
            rays,
            cosines: [rays[0].dot(&rays[1]), rays[0].dot(&rays[2]), rays[1].dot(&rays[2])],
            squares: [sides[0].norm_squared() / longest, sides[1].norm_squared() / longest],
            unit_m: longest.sqrt(),
            corner: points[i].coords,
            inverse: [sides[1].cross(&normal) / area, normal.cross(&sides[0]) / area, normal / area],
        })
    }

    /// The pencil h A + g B of the conics that result from eliminating the longest side.
    fn conic(&self, h: f64, g: f64) -> Matrix3<f64> {
        let ([c01, c02, c12], [a, b]) = (self.cosines, self.squares);
        let (m01, m02, m12) = (-h * c01, -g * c02, c12 * (h * a + g * b));
        Matrix3::new(h + g, m01, m02, m01, h - h * a - g * b, m12, m02, m12, g - h * a - g * b)
    }

    /// The two lines of a degenerate conic of the pencil, and another conic to intersect them with.
    fn line_pair(&self) -> Option<([Vector3<f64>; 2], Matrix3<f64>)> {
        let ([c01, c02, c12], [a, b]) = (self.cosines, self.squares);
        let sine = 1.0 - c12 * c12;
        let (k0, k1, k2) = (a * (sine * a - 1.0), 1.0 - a - b + 2.0 * sine * a * b, b * (sine * b - 1.0));
        let triple = 2.0 * c01 * c02 * c12;
        // det(A + g B) = p[0] + p[1] g + p[2] g^2 + p[3] g^3.
        let p = [
            k0 + c01 * c01 * a,
            k0 + k1 - c01 * c01 * (1.0 - b) + triple * a,
            k1 + k2 + triple * b - c02 * c02 * (1.0 - a),
            k2 + c02 * c02 * b,
        ];
        // The larger of the outer coefficients leads, so that a root at infinity becomes one at zero.
        let (h, g) = if p[3].abs() >= p[0].abs() {
            (1.0, real_root(p[2] / p[3], p[1] / p[3], p[0] / p[3]))
        } else {
            (real_root(p[1] / p[0], p[2] / p[0], p[3] / p[0]), 1.0)
        };
        let scale = 1.0 / h.abs().max(g.abs());
        let lines = split(&self.conic(h * scale, g * scale))?;
        let other = if h.abs() > g.abs() { self.conic(0.0, 1.0) } else { self.conic(1.0, 0.0) };
        Some((lines, other))
    }

    /// Distances along the rays from their ratio, polished by Newton steps on the three equations. All positive.
    fn distances(&self, ratio: &Vector3<f64>) -> Option<Vector3<f64>> {
        let [c01, c02, c12] = self.cosines;
        let square = ratio.y * ratio.y + ratio.z * ratio.z - 2.0 * c12 * ratio.y * ratio.z;
        let mut d = ratio * (1.0 / square.sqrt()).copysign(ratio.x);
        for step in 0..4 {
            if !(d.x > 0.0 && d.y > 0.0 && d.z > 0.0) {
                return None;
            }
            let r0 = d.x * d.x + d.y * d.y - 2.0 * c01 * d.x * d.y - self.squares[0];
            let r1 = d.x * d.x + d.z * d.z - 2.0 * c02 * d.x * d.z - self.squares[1];
            let r2 = d.y * d.y + d.z * d.z - 2.0 * c12 * d.y * d.z - 1.0;
            let off = r0.abs().max(r1.abs()).max(r2.abs());
            if off < 1e-13 || step == 3 {
                return (off < 1e-9).then_some(d);
            }
            // Half the Jacobian is [a0 a1 0; b0 0 b2; 0 e1 e2]; Cramer's rule.
            let (a0, a1) = (d.x - c01 * d.y, d.y - c01 * d.x);
            let (b0, b2) = (d.x - c02 * d.z, d.z - c02 * d.x);
            let (e1, e2) = (d.y - c12 * d.z, d.z - c12 * d.y);
            let half = 0.5 / (a0 * b2 * e1 + a1 * b0 * e2);
            d.x -= half * (r0 * b2 * e1 + a1 * (r1 * e2 - b2 * r2));
            d.y -= half * (a0 * (b2 * r2 - r1 * e2) + r0 * b0 * e2);
            d.z -= half * (e1 * (a0 * r1 - r0 * b0) + a1 * b0 * r2);
        }
        None
    }

    fn pose(&self, distances: &Vector3<f64>) -> CameraPose {
        let d = distances * self.unit_m;
        let corner = self.rays[0] * d.x;
        let (first, second) = (corner - self.rays[1] * d.y, corner - self.rays[2] * d.z);
        let [i0, i1, i2] = &self.inverse;
        let r = first * i0.transpose() + second * i1.transpose() + first.cross(&second) * i2.transpose();
        CameraPose { r, p: self.corner - r.tr_mul(&corner) }
    }
}

/// Splits the degenerate conic l m^T + m l^T into l and m. `None` if they are complex.
fn split(conic: &Matrix3<f64>) -> Option<[Vector3<f64>; 2]> {
    let m = conic;
    // The adjugate of l m^T + m l^T is -(l x m)(l x m)^T: its diagonal is negative where the lines are real.
    let squares = [m.m23 * m.m23 - m.m22 * m.m33, m.m13 * m.m13 - m.m11 * m.m33, m.m12 * m.m12 - m.m11 * m.m22];
    let (a01, a02, a12) = (m.m13 * m.m23 - m.m12 * m.m33, m.m12 * m.m23 - m.m13 * m.m22, m.m12 * m.m13 - m.m11 * m.m23);
    let (square, column) = if squares[0] >= squares[1] && squares[0] >= squares[2] {
        (squares[0], Vector3::new(-squares[0], a01, a02))
    } else if squares[1] >= squares[2] {
        (squares[1], Vector3::new(a01, -squares[1], a12))
    } else {
        (squares[2], Vector3::new(a02, a12, -squares[2]))
    };
    // Rounding can push a double line just below zero; a clear negative, or a NaN, means that nothing is real.
    if square.is_nan() || square < -1e-12 {
        return None;
    }
    let v = if square > 1e-18 { column / square.sqrt() } else { Vector3::zeros() };
    // conic + [v]x is 2 l m^T: a row gives m, a column gives l.
    let rank_one =
        Matrix3::new(m.m11, m.m12 - v.z, m.m13 + v.y, m.m12 + v.z, m.m22, m.m23 - v.x, m.m13 - v.y, m.m23 + v.x, m.m33);
    let (row, column) = rank_one.iamax_full();
    Some([rank_one.row(row).transpose(), rank_one.column(column).into_owned()])
}

/// The points of a conic on a line, homogeneous.
fn meet(line: &Vector3<f64>, conic: &Matrix3<f64>) -> [Option<Vector3<f64>>; 2] {
    let i = line.iamax();
    let (j, k) = ((i + 1) % 3, (i + 2) % 3);
    // On the line, component i is alpha times component j plus beta times component k.
    let (alpha, beta) = (-line[j] / line[i], -line[k] / line[i]);
    let (qii, qij, qik) = (conic[(i, i)], conic[(i, j)], conic[(i, k)]);
    let a = conic[(j, j)] + alpha * (2.0 * qij + alpha * qii);
    let b = conic[(j, k)] + beta * qij + alpha * (qik + beta * qii);
    let c = conic[(k, k)] + beta * (2.0 * qik + beta * qii);
    let discriminant = b * b - a * c;
    // Rounding can push a double root just below zero; a clear negative, or a NaN, means that there is no real point.
    if discriminant.is_nan() || discriminant < -1e-12 {
        return [None; 2];
    }
    let q = -(b + discriminant.max(0.0).sqrt().copysign(b));
    // Distances are positive: a pair of other signs is not worth completing.
    let point = |on_j: f64, on_k: f64| {
        let on_i = alpha * on_j + beta * on_k;
        if !(on_j * on_k > 0.0 && on_i * on_j > 0.0) {
            return None;
        }
        let mut d = Vector3::zeros();
        (d[i], d[j], d[k]) = (on_i, on_j, on_k);
        Some(d)
    };
    [point(q, a), point(c, q)]
}

/// One real root of x^3 + b x^2 + c x + d, the one farthest from any other.
fn real_root(b: f64, c: f64, d: f64) -> f64 {
    let shift = b / 3.0;
    let (p, q) = (c - b * shift, d + shift * (2.0 * shift * shift - c));
    let (half_q, third_p) = (0.5 * q, p / 3.0);
    let discriminant = half_q * half_q + third_p * third_p * third_p;
    let mut x = if discriminant >= 0.0 {
        let u = ComplexField::cbrt(half_q.abs() + discriminant.sqrt());
        // u is at least the root of p / 3: the two terms never change the sign.
        if u > 0.0 { -(u - third_p / u).copysign(q) } else { 0.0 }
    } else {
        // Three roots. From beyond the outermost Newton's steps fall monotonically.
        let turn = (-third_p).sqrt();
        -(turn + ((2.0 * turn * turn * turn + q.abs()) / (3.0 * turn)).sqrt()).copysign(q)
    } - shift;
    for _ in 0..6 {
        let step = (((x + b) * x + c) * x + d) / ((3.0 * x + 2.0 * b) * x + c);
        if !step.is_finite() {
            break;
        }
        x -= step;
        if step.abs() <= 1e-14 * x.abs() {
            break;
        }
    }
    x
}
