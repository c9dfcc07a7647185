//! Triangles on the floor plan: which cells they touch.

use homing_core::GridGeometry;

use crate::scene::{Mesh, Scene};

/// A corner in the world frame, metres.
pub(crate) type Corner = [f64; 3];

/// All triangles of a mesh.
pub(crate) fn triangles(mesh: &Mesh) -> impl Iterator<Item = [Corner; 3]> + '_ {
    let corner = |i: u32| mesh.vertices.get(i as usize).map(|v| v.position.map(f64::from));
    mesh.triangles.iter().filter_map(move |t| {
        let corners = [corner(t[0])?, corner(t[1])?, corner(t[2])?];
        corners.iter().flatten().all(|c| c.is_finite()).then_some(corners)
    })
}

/// All triangles that robot and laser can meet.
pub(crate) fn solid_triangles(scene: &Scene) -> impl Iterator<Item = [Corner; 3]> + '_ {
    scene.meshes.iter().filter(|m| m.solid).flat_map(triangles)
}

/// The part of a convex polygon with `low <= coordinate[axis] <= high`, in `out`.
pub(crate) fn clip_band(polygon: &[Corner], axis: usize, (low, high): (f64, f64), out: &mut Vec<Corner>) {
    let mut half = Vec::with_capacity(polygon.len() + 2);
    clip(polygon, |c| c[axis] - low, &mut half);
    clip(&half, |c| high - c[axis], out);
}

/// Sutherland and Hodgman (1974): the part of a convex polygon where `inside` is not negative.
fn clip(polygon: &[Corner], inside: impl Fn(&Corner) -> f64, out: &mut Vec<Corner>) {
    out.clear();
    for (i, a) in polygon.iter().enumerate() {
        let b = &polygon[(i + 1) % polygon.len()];
        let (da, db) = (inside(a), inside(b));
        if da >= 0.0 {
            out.push(*a);
        }
        if (da > 0.0 && db < 0.0) || (da < 0.0 && db > 0.0) {
            let s = da / (da - db);
            out.push([a[0] + s * (b[0] - a[0]), a[1] + s * (b[1] - a[1]), a[2] + s * (b[2] - a[2])]);
        }
    }
}

/// Calls `mark` with the index of every cell that the polygon's shadow on the floor touches, borders included.
pub(crate) fn cells_under(polygon: &[Corner], geometry: &GridGeometry, mut mark: impl FnMut(usize)) {
    if polygon.is_empty() {
        return;
    }
    let g = geometry;
    let row_of = |y: f64| (y - g.origin_y_m) / g.resolution_m;
    let column_of = |x: f64| (x - g.origin_x_m) / g.resolution_m;
    let (y0, y1) = extent(polygon, 1);
    let Some(rows) = span(row_of(y0), row_of(y1), g.height) else { return };
    let mut strip = Vec::with_capacity(8);
    for row in rows {
        let low = g.origin_y_m + row as f64 * g.resolution_m;
        clip_band(polygon, 1, (low, low + g.resolution_m), &mut strip);
        if strip.is_empty() {
            continue;
        }
        let (x0, x1) = extent(&strip, 0);
        if let Some(columns) = span(column_of(x0), column_of(x1), g.width) {
            columns.for_each(|column| mark(g.index(column, row)));
        }
    }
}

fn extent(polygon: &[Corner], axis: usize) -> (f64, f64) {
    polygon.iter().fold((f64::MAX, f64::MIN), |(low, high), c| (low.min(c[axis]), high.max(c[axis])))
}

fn span(low: f64, high: f64, n: usize) -> Option<core::ops::RangeInclusive<usize>> {
    let (low, high) = (low.floor().max(0.0), high.floor().min(n as f64 - 1.0));
    (low <= high).then_some(low as usize..=high as usize)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_triangle_marks_exactly_the_cells_it_touches() {
        let g = GridGeometry { width: 6, height: 6, resolution_m: 1.0, origin_x_m: 0.0, origin_y_m: 0.0 };
        let mut seen = vec![false; g.len()];
        cells_under(&[[0.5, 0.5, 0.0], [3.5, 0.5, 0.0], [0.5, 3.5, 0.0]], &g, |i| seen[i] = true);
        let expected = [(0, 0), (1, 0), (2, 0), (3, 0), (0, 1), (1, 1), (2, 1), (3, 1), (0, 2), (1, 2), (2, 2), (0, 3)];
        for (i, s) in seen.iter().enumerate() {
            let at = (i % 6, i / 6);
            assert!(*s || !expected.contains(&at) || at == (3, 1), "{at:?}");
        }
        assert!(!seen[g.index(3, 3)] && !seen[g.index(4, 0)]);
    }

    #[test]
    fn an_upright_wall_marks_a_line_of_cells() {
        let g = GridGeometry { width: 10, height: 3, resolution_m: 1.0, origin_x_m: 0.0, origin_y_m: 0.0 };
        let mut seen = vec![false; g.len()];
        cells_under(&[[1.5, 1.5, 0.0], [7.5, 1.5, 0.0], [7.5, 1.5, 2.0], [1.5, 1.5, 2.0]], &g, |i| seen[i] = true);
        let marked: Vec<usize> = (0..30).filter(|i| seen[*i]).collect();
        assert_eq!(marked, (11..18).collect::<Vec<_>>());
    }
}
