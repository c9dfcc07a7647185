//! The map of the picture: walls, paths, start, goal and end, legend and scale.

use homing_core::{Cell, OccupancyGrid, PlanarPose};

use super::EpisodePicture;
use crate::canvas::{Align, Canvas, Rect, Style, text_width};
use crate::encode::known_box;
use crate::palette::{Rgb, light};

/// Kept free around everything that is drawn, metres.
const MARGIN_M: f64 = 0.6;
/// Height of the strip below the map that holds legend and scale, pixels.
const LEGEND_PX: f64 = 46.0;

/// Draws the map into a panel.
pub(super) fn draw(canvas: &mut Canvas, panel: Rect, episode: &EpisodePicture<'_>) {
    canvas.text((panel.x, panel.y - 11.0), Align::Left, Style::bold(10.5, light::TEXT), "Where it drove");
    canvas.fill(panel, light::UNKNOWN);
    let area = Rect { height: panel.height - LEGEND_PX, ..panel };
    let view = View::fit(area, episode);
    draw_cells(canvas, area, &view, episode.map);
    draw_paths(canvas, &view, episode);
    draw_places(canvas, &view, episode);
    let strip = Rect { y: panel.y + area.height, height: LEGEND_PX, ..panel };
    canvas.fill(strip, light::PANEL);
    draw_legend(canvas, strip, episode);
    draw_scale(canvas, strip, &view);
}

/// Maps metres of the odometry frame to pixels, y up.
struct View {
    left_px: f64,
    bottom_px: f64,
    x_m: f64,
    y_m: f64,
    px_per_m: f64,
}

impl View {
    /// Shows everything known and everything drawn, as large as fits.
    fn fit(area: Rect, episode: &EpisodePicture<'_>) -> Self {
        let (mut low, mut high) = ((f64::INFINITY, f64::INFINITY), (f64::NEG_INFINITY, f64::NEG_INFINITY));
        let mut include = |x: f64, y: f64| {
            if x.is_finite() && y.is_finite() {
                low = (low.0.min(x), low.1.min(y));
                high = (high.0.max(x), high.1.max(y));
            }
        };
        if let Some([c0, r0, c1, r1]) = known_box(episode.map, 0) {
            for (c, r) in [(c0, r0), (c1, r1)] {
                let (x, y) = episode.map.geometry.centre(c, r);
                include(x, y);
            }
        }
        let paths = [episode.estimated_path_m, episode.true_path_m, episode.shortest_path_m];
        paths.into_iter().flatten().for_each(|&(x, y)| include(x, y));
        let places = [Some(episode.start), Some(episode.end), episode.goal, episode.goal_estimate];
        places.into_iter().flatten().for_each(|pose| include(pose.x_m, pose.y_m));
        let (width, height) = (high.0 - low.0 + 2.0 * MARGIN_M, high.1 - low.1 + 2.0 * MARGIN_M);
        let px_per_m = (area.width / width).min(area.height / height).min(140.0);
        Self {
            left_px: area.x + 0.5 * (area.width - width * px_per_m),
            bottom_px: area.y + 0.5 * (area.height + height * px_per_m),
            x_m: low.0 - MARGIN_M,
            y_m: low.1 - MARGIN_M,
            px_per_m,
        }
    }

    fn at(&self, x_m: f64, y_m: f64) -> (f64, f64) {
        (self.left_px + (x_m - self.x_m) * self.px_per_m, self.bottom_px - (y_m - self.y_m) * self.px_per_m)
    }

    fn path(&self, path_m: &[(f64, f64)]) -> Vec<(f64, f64)> {
        let finite = path_m.iter().filter(|(x, y)| x.is_finite() && y.is_finite());
        finite.map(|&(x, y)| self.at(x, y)).collect()
    }

    fn metres(&self, x_px: f64, y_px: f64) -> (f64, f64) {
        (self.x_m + (x_px - self.left_px) / self.px_per_m, self.y_m + (self.bottom_px - y_px) / self.px_per_m)
    }
}

/// Blends neighbouring cells, so that walls have smooth edges at any scale.
fn draw_cells(canvas: &mut Canvas, area: Rect, view: &View, map: &OccupancyGrid) {
    let geometry = map.geometry;
    let colour = |c: f64, r: f64| -> Rgb {
        let inside = c >= 0.0 && r >= 0.0;
        match if inside { map.at(c as usize, r as usize) } else { Cell::Unknown } {
            Cell::Unknown => light::UNKNOWN,
            Cell::Free => light::FREE,
            Cell::Occupied => light::OCCUPIED,
        }
    };
    canvas.paint(area, |x_px, y_px| {
        let (x_m, y_m) = view.metres(x_px, y_px);
        let u = (x_m - geometry.origin_x_m) / geometry.resolution_m - 0.5;
        let v = (y_m - geometry.origin_y_m) / geometry.resolution_m - 0.5;
        let (c, r) = (u.floor(), v.floor());
        let (fu, fv) = (smooth(u - c), smooth(v - r));
        let corners = [colour(c, r), colour(c + 1.0, r), colour(c, r + 1.0), colour(c + 1.0, r + 1.0)];
        let weights = [(1.0 - fu) * (1.0 - fv), fu * (1.0 - fv), (1.0 - fu) * fv, fu * fv];
        core::array::from_fn(|k| {
            let sum: f64 = corners.iter().zip(weights).map(|(corner, w)| f64::from(corner[k]) * w).sum();
            sum.round() as u8
        })
    });
}

/// Steeper than linear, so that an edge is soft over a pixel or two instead of a whole cell.
fn smooth(t: f64) -> f64 {
    ((t - 0.5) * 2.5 + 0.5).clamp(0.0, 1.0)
}

fn draw_paths(canvas: &mut Canvas, view: &View, episode: &EpisodePicture<'_>) {
    canvas.dashes(&view.path(episode.shortest_path_m), 2.5, 9.0, 7.0, light::SHORTEST);
    let truth = view.path(episode.true_path_m);
    if truth.len() > 1 {
        canvas.line(&truth, 9.0, light::GROUND);
        canvas.line(&truth, 6.0, light::TRUE);
    }
    let estimated = view.path(episode.estimated_path_m);
    if estimated.len() > 1 {
        canvas.line(&estimated, 2.6, light::ESTIMATED);
    }
}

fn draw_places(canvas: &mut Canvas, view: &View, episode: &EpisodePicture<'_>) {
    let mut labels = Labels::default();
    draw_pose(canvas, view, &episode.start, light::START, 9.0);
    if let Some(goal) = &episode.goal {
        draw_pose(canvas, view, goal, light::GOAL, 13.0);
    }
    if let Some(goal) = &episode.goal_estimate {
        let (x, y) = view.at(goal.x_m, goal.y_m);
        for (dx, dy) in [(1.0, 1.0), (1.0, -1.0)] {
            let cross = [(x - 9.0 * dx, y - 9.0 * dy), (x + 9.0 * dx, y + 9.0 * dy)];
            canvas.line(&cross, 6.5, light::GROUND);
            canvas.line(&cross, 3.0, light::GOAL);
        }
    }
    let end_colour = if episode.true_path_m.is_empty() { light::ESTIMATED } else { light::TRUE };
    draw_pose(canvas, view, &episode.end, end_colour, 9.0);
    labels.put(canvas, view.at(episode.end.x_m, episode.end.y_m), end_colour, "end");
    if let Some(goal) = episode.goal.or(episode.goal_estimate) {
        labels.put(canvas, view.at(goal.x_m, goal.y_m), light::GOAL, "goal");
    }
    labels.put(canvas, view.at(episode.start.x_m, episode.start.y_m), light::START, "start");
}

/// A disc with a wedge that points where the pose looks.
fn draw_pose(canvas: &mut Canvas, view: &View, pose: &PlanarPose, colour: Rgb, radius: f64) {
    let (x, y) = view.at(pose.x_m, pose.y_m);
    let towards = |angle: f64, length: f64| (x + length * angle.cos(), y - length * angle.sin());
    let wedge = |tip: f64, side: f64| {
        [towards(pose.yaw_rad, tip), towards(pose.yaw_rad + 1.1, side), towards(pose.yaw_rad - 1.1, side)]
    };
    canvas.convex(&wedge(2.35 * radius + 4.0, radius + 2.5), light::GROUND);
    canvas.disc((x, y), radius + 2.5, light::GROUND);
    canvas.convex(&wedge(2.35 * radius, radius), colour);
    canvas.disc((x, y), radius, colour);
    canvas.disc((x, y), 0.42 * radius, light::GROUND);
}

/// Puts names beside places without one covering another.
#[derive(Default)]
struct Labels {
    taken: Vec<(f64, f64)>,
}

impl Labels {
    fn put(&mut self, canvas: &mut Canvas, (x, y): (f64, f64), colour: Rgb, text: &str) {
        let style = Style::bold(12.0, colour);
        let reach = 34.0 + 0.5 * text_width(text, style.size_px);
        let free = |dx: f64, dy: f64| {
            let near = |at: &(f64, f64)| (at.0 - x - dx).abs() < 64.0 && (at.1 - y - dy).abs() < 20.0;
            !self.taken.iter().any(near)
        };
        let places = [(0.0, 44.0), (0.0, -32.0), (reach, 6.0), (-reach, 6.0), (0.0, 66.0), (0.0, -54.0)];
        let (dx, dy) = places.into_iter().find(|&(dx, dy)| free(dx, dy)).unwrap_or(places[0]);
        self.taken.extend([(x + dx, y + dy), (x, y)]);
        canvas.text_on((x + dx, y + dy), Align::Centre, style, light::GROUND, text);
    }
}

fn draw_legend(canvas: &mut Canvas, strip: Rect, episode: &EpisodePicture<'_>) {
    let y = strip.y + 0.5 * strip.height;
    let mut x = strip.x + 22.0;
    let style = Style::regular(9.5, light::TEXT);
    let lines = [
        ("true path", light::TRUE, 6.0, !episode.true_path_m.is_empty()),
        ("estimated path", light::ESTIMATED, 2.6, !episode.estimated_path_m.is_empty()),
    ];
    for (name, colour, width, _) in lines.into_iter().filter(|line| line.3) {
        canvas.line(&[(x, y), (x + 34.0, y)], width, colour);
        x += 46.0;
        x += canvas.text((x, y + 4.5), Align::Left, style, name) + 30.0;
    }
    if !episode.shortest_path_m.is_empty() {
        canvas.dashes(&[(x, y), (x + 36.0, y)], 2.5, 9.0, 7.0, light::SHORTEST);
        x += 46.0;
        x += canvas.text((x, y + 4.5), Align::Left, style, "shortest path") + 30.0;
    }
    if episode.goal_estimate.is_some() {
        for dy in [-7.0, 7.0] {
            canvas.line(&[(x, y - dy), (x + 14.0, y + dy)], 3.0, light::GOAL);
        }
        x += 26.0;
        canvas.text((x, y + 4.5), Align::Left, style, "goal as estimated");
    }
}

/// A bar of 1, 2 or 5 metres, whichever is nearest to 120 pixels.
fn draw_scale(canvas: &mut Canvas, strip: Rect, view: &View) {
    let off = |metres: &f64| (metres * view.px_per_m / 120.0).ln().abs();
    let lengths = [0.5, 1.0, 2.0, 5.0, 10.0, 20.0, 50.0];
    let metres = lengths.into_iter().min_by(|a, b| off(a).total_cmp(&off(b))).unwrap_or(1.0);
    let (right, y) = (strip.x + strip.width - 22.0, strip.y + 0.5 * strip.height + 8.0);
    let left = right - metres * view.px_per_m;
    for bar in [[(left, y), (right, y)], [(left, y - 5.0), (left, y)], [(right, y - 5.0), (right, y)]] {
        canvas.line(&bar, 2.0, light::TEXT);
    }
    let style = Style::regular(9.5, light::TEXT);
    canvas.text((0.5 * (left + right), y - 9.0), Align::Centre, style, &format!("{metres} m"));
}
