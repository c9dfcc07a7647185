//! The minimal kernel: the camera's pose from three points and the rays they are seen along.
//!
//! With d_i the distance to point i along ray f_i, the law of cosines gives d_i^2 + d_j^2 - 2 d_i d_j (f_i . f_j) =
//! |X_i - X_j|^2 for the three pairs. Eliminating the right-hand sides leaves two conics in (d_1 : d_2 : d_3). A member
//! of their pencil with zero determinant is a pair of lines; each line meets another member in two points, so there are
//! up to four solutions (the approach of Persson and Nordberg, "Lambda Twist", ECCV 2018, and of Ding et al.,
//! "Revisiting the P3P Problem", CVPR 2023).

use nalgebra::{ComplexField, Matrix3, Point3, Vector3};

use super::CameraPose;

/// Appends the poses (at most four) from which `points` (metres, any frame) lie along `rays` (unit, camera frame).
///
/// Points in line or rays that coincide give none. Every pose appended is finite and sees its points in front.
pub fn p3p(rays: &[Vector3<f64>; 3], points: &[Point3<f64>; 3], poses: &mut Vec<CameraPose>) {
    let sides = [points[0] - points[1], points[0] - points[2], points[1] - points[2]];
    let a = [sides[0].norm_squared(), sides[1].norm_squared(), sides[2].norm_squared()];
    let normal = sides[0].cross(&sides[1]);
    // Twice the triangle's area against its longest side squared: below 1e-4 the plane through the points is undefined.
    if normal.norm() < 1e-4 * a[0].max(a[1]).max(a[2]) {
        return;
    }
    let Some(points_inverse) = Matrix3::from_columns(&[sides[0], sides[1], normal]).try_inverse() else { return };
    let forms = cosine_forms(rays);
    let first = forms[0] * a[2] - forms[2] * a[0];
    let second = forms[1] * a[2] - forms[2] * a[1];
    let (first, second) = (first / first.norm(), second / second.norm());
    let Some((lines, other)) = line_pair(&first, &second) else { return };
    for line in lines {
        for ratio in meet(&line, &other) {
            let Some(d) = distances(&ratio, &forms, &a) else { continue };
            let y = [rays[0] * d.x, rays[1] * d.y, rays[2] * d.z];
            let (s0, s1) = (y[0] - y[1], y[0] - y[2]);
            let r = Matrix3::from_columns(&[s0, s1, s0.cross(&s1)]) * points_inverse;
            let pose = CameraPose { r, p: points[0].coords - r.transpose() * y[0] };
            if pose.is_rigid() {
                poses.push(pose);
            }
        }
    }
}

/// The quadratic forms of the pairs (0, 1), (0, 2), (1, 2).
fn cosine_forms(rays: &[Vector3<f64>; 3]) -> [Matrix3<f64>; 3] {
    [(0, 1), (0, 2), (1, 2)].map(|(i, j)| {
        let mut form = Matrix3::zeros();
        form[(i, i)] = 1.0;
        form[(j, j)] = 1.0;
        form[(i, j)] = -rays[i].dot(&rays[j]);
        form[(j, i)] = form[(i, j)];
        form
    })
}

/// The two lines of the best-conditioned degenerate conic `a + g b`, and the conic to intersect them with.
fn line_pair(a: &Matrix3<f64>, b: &Matrix3<f64>) -> Option<([Vector3<f64>; 2], Matrix3<f64>)> {
    let (adj_a, adj_b) = (adjugate(a), adjugate(b));
    let cubic = [b.determinant(), (a * adj_b).trace(), (adj_a * b).trace(), a.determinant()];
    let mut best: Option<(f64, f64, Matrix3<f64>)> = None;
    for g in real_roots(&cubic).into_iter().flatten() {
        let scale = 1.0 / (1.0 + g.abs());
        let conic = (a + b * g) * scale;
        // The adjugate of l m^T + m l^T is -(l x m)(l x m)^T: a positive diagonal means that the lines are complex.
        let realness = -adjugate(&conic).trace();
        if best.is_none_or(|(r, ..)| realness > r) {
            best = Some((realness, g, conic));
        }
    }
    let (realness, g, conic) = best?;
    if realness < -1e-12 {
        return None;
    }
    let other = if g.abs() < 1.0 { *b } else { *a };
    Some((split(&conic)?, other))
}

/// Splits the degenerate conic l m^T + m l^T into l and m.
fn split(conic: &Matrix3<f64>) -> Option<[Vector3<f64>; 2]> {
    let adj = adjugate(conic);
    let i = (0..3).max_by(|&i, &j| (-adj[(i, i)]).total_cmp(&-adj[(j, j)]))?;
    let vertex = if adj[(i, i)] < -1e-18 { adj.column(i) / (-adj[(i, i)]).sqrt() } else { Vector3::zeros() };
    let rank_one = conic + vertex.cross_matrix();
    let k = rank_one.iamax_full();
    let (line, other) = (rank_one.row(k.0).transpose(), rank_one.column(k.1).into_owned());
    Some([line.try_normalize(1e-12)?, other.try_normalize(1e-12)?])
}

/// The points of a conic on a line, homogeneous.
fn meet(line: &Vector3<f64>, conic: &Matrix3<f64>) -> impl Iterator<Item = Vector3<f64>> + use<> {
    let axis = Vector3::ith(line.iamin(), 1.0);
    let u = line.cross(&axis).normalize();
    let v = line.cross(&u);
    let (a, b, c) = (u.dot(&(conic * u)), u.dot(&(conic * v)), v.dot(&(conic * v)));
    let discriminant = b * b - a * c;
    // Rounding can push a double root just below zero; a clear negative means no real point.
    let real = discriminant > -1e-12;
    let q = -(b + discriminant.max(0.0).sqrt().copysign(b));
    [u * q + v * a, u * c + v * q].into_iter().filter(move |_| real)
}

/// Distances along the rays from their ratio, polished by Newton steps on the three equations.
fn distances(ratio: &Vector3<f64>, forms: &[Matrix3<f64>; 3], a: &[f64; 3]) -> Option<Vector3<f64>> {
    let sign = if ratio.sum() < 0.0 { -1.0 } else { 1.0 };
    let total: f64 = forms.iter().map(|form| ratio.dot(&(form * ratio))).sum();
    let mut d = ratio * (sign * ((a[0] + a[1] + a[2]) / total).sqrt());
    for _ in 0..3 {
        if !(d.iter().all(|x| x.is_finite()) && d.min() > 0.0) {
            return None;
        }
        let images = forms.map(|form| form * d);
        let residual = Vector3::new(d.dot(&images[0]) - a[0], d.dot(&images[1]) - a[1], d.dot(&images[2]) - a[2]);
        let jacobian = Matrix3::from_columns(&images).transpose() * 2.0;
        let Some(inverse) = jacobian.try_inverse() else { break };
        d -= inverse * residual;
    }
    let off = forms.iter().zip(a).map(|(form, a)| (d.dot(&(form * d)) - a).abs()).fold(0.0, f64::max);
    (d.min() > 0.0 && off <= 1e-6 * (a[0] + a[1] + a[2])).then_some(d)
}

fn adjugate(m: &Matrix3<f64>) -> Matrix3<f64> {
    let (r0, r1, r2) = (m.row(0).transpose(), m.row(1).transpose(), m.row(2).transpose());
    Matrix3::from_columns(&[r1.cross(&r2), r2.cross(&r0), r0.cross(&r1)])
}

/// Real roots of c0 x^3 + c1 x^2 + c2 x + c3.
fn real_roots(c: &[f64; 4]) -> [Option<f64>; 3] {
    let largest = c.iter().fold(0.0_f64, |m, x| m.max(x.abs()));
    if c[0].abs() < 1e-12 * largest {
        return quadratic_roots(c[1], c[2], c[3], largest);
    }
    let (b, c, d) = (c[1] / c[0], c[2] / c[0], c[3] / c[0]);
    let shift = b / 3.0;
    let (p, q) = (c - b * shift, d + shift * (2.0 * shift * shift - c));
    let (half_q, third_p) = (0.5 * q, p / 3.0);
    let discriminant = half_q * half_q + third_p * third_p * third_p;
    let mut roots = [None; 3];
    if discriminant >= 0.0 {
        let u = -ComplexField::cbrt(half_q.abs() + discriminant.sqrt()).copysign(half_q);
        roots[0] = Some(if u == 0.0 { -shift } else { u - third_p / u - shift });
    } else {
        let radius = (-third_p).sqrt();
        let angle = ComplexField::acos((-half_q / (radius * radius * radius)).clamp(-1.0, 1.0)) / 3.0;
        for (k, root) in roots.iter_mut().enumerate() {
            let turn = core::f64::consts::TAU / 3.0 * k as f64;
            *root = Some(2.0 * radius * ComplexField::cos(angle - turn) - shift);
        }
    }
    for x in roots.iter_mut().flatten() {
        for _ in 0..3 {
            let slope = (3.0 * *x + 2.0 * b) * *x + c;
            let step = (((*x + b) * *x + c) * *x + d) / slope;
            if step.is_finite() {
                *x -= step;
            }
        }
    }
    roots
}

fn quadratic_roots(a: f64, b: f64, c: f64, largest: f64) -> [Option<f64>; 3] {
    if a.abs() < 1e-12 * largest {
        return [(b != 0.0).then(|| -c / b), None, None];
    }
    let discriminant = b * b - 4.0 * a * c;
    if discriminant < 0.0 {
        return [None; 3];
    }
    let q = -0.5 * (b + discriminant.sqrt().copysign(b));
    [Some(q / a), (q != 0.0).then(|| c / q), None]
}
