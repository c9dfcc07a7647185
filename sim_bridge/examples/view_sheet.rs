//! Shows the views of a flat and what its pairs share: `view_sheet SEED PREFIX [VIEWS]` writes PREFIX_views.png, and
//! PREFIX_pairs.png with lines between points that both views of a pair see.

#![expect(clippy::unwrap_used, reason = "a tool for looking at views may fail by panicking")]

use homing_sim::views::{self, FlatViews, View, ViewPair, ViewSpec};
use image::{Rgb, RgbImage};

/// Views side by side.
const COLUMNS: u32 = 4;
/// Pairs shown, spread evenly over their overlaps.
const PAIRS: usize = 8;
/// Pixels from one line to the next, both ways.
const LINES_PX: usize = 48;

fn main() {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let [seed, prefix, rest @ ..] = arguments.as_slice() else {
        eprintln!("view_sheet SEED PREFIX [VIEWS]");
        std::process::exit(2);
    };
    let n_views = rest.first().map_or(16, |n| n.parse().unwrap());
    let flat = views::draw(seed.parse().unwrap(), &ViewSpec { n_views, ..ViewSpec::default() }).unwrap();
    for (i, view) in flat.views.iter().enumerate() {
        let p = view.t_world_camera.translation();
        let hfov_deg = view.camera.hfov_rad().to_degrees();
        println!("view {i}: variant {}, at {:.2} {:.2} {:.2}, {hfov_deg:.0} deg wide", view.variant, p.x, p.y, p.z);
    }
    sheet_of_views(&flat).save(format!("{prefix}_views.png")).unwrap();
    sheet_of_pairs(&flat).save(format!("{prefix}_pairs.png")).unwrap();
}

fn sheet_of_views(flat: &FlatViews) -> RgbImage {
    let (w, h) = (flat.views[0].camera.width(), flat.views[0].camera.height());
    let mut sheet = RgbImage::new(COLUMNS * w, (flat.views.len() as u32).div_ceil(COLUMNS) * h);
    for (i, view) in flat.views.iter().enumerate() {
        paste(&mut sheet, view, (i as u32 % COLUMNS * w, i as u32 / COLUMNS * h));
    }
    sheet
}

/// Two pairs a row.
fn sheet_of_pairs(flat: &FlatViews) -> RgbImage {
    let (w, h) = (flat.views[0].camera.width(), flat.views[0].camera.height());
    let mut pairs: Vec<ViewPair> = flat.pairs.clone();
    pairs.sort_by(|a, b| a.overlap.total_cmp(&b.overlap));
    let shown: Vec<ViewPair> =
        (0..PAIRS.min(pairs.len())).map(|k| pairs[k * pairs.len() / PAIRS.min(pairs.len())]).collect();
    let mut sheet = RgbImage::new(4 * w, (shown.len() as u32).div_ceil(2).max(1) * h);
    for (k, pair) in shown.iter().enumerate() {
        let corner = (k as u32 % 2 * 2 * w, k as u32 / 2 * h);
        let (a, b) = (&flat.views[pair.a], &flat.views[pair.b]);
        println!(
            "pair {k}: views {} and {}, overlap {:.2}, {:.0} deg, {:.1} m",
            pair.a,
            pair.b,
            pair.overlap,
            pair.yaw_rad.to_degrees(),
            pair.distance_m
        );
        paste(&mut sheet, a, corner);
        paste(&mut sheet, b, (corner.0 + w, corner.1));
        for (i, (from, to)) in shared_points(a, b).into_iter().enumerate() {
            let colour = [Rgb([255, 60, 60]), Rgb([60, 255, 60]), Rgb([90, 120, 255]), Rgb([255, 230, 40])][i % 4];
            let at = |p: (f64, f64), right: u32| (p.0 + f64::from(corner.0 + right), p.1 + f64::from(corner.1));
            line(&mut sheet, at(from, 0), at(to, w), colour);
        }
    }
    sheet
}

/// Points on a grid over `a`, with where `b` sees them.
fn shared_points(a: &View, b: &View) -> Vec<((f64, f64), (f64, f64))> {
    let t_b_a = b.t_world_camera.inverse() * a.t_world_camera;
    let mut points = Vec::new();
    for row in (LINES_PX / 2..a.camera.height() as usize).step_by(LINES_PX) {
        for column in (LINES_PX / 2..a.camera.width() as usize).step_by(LINES_PX) {
            let (x, y) = (column as f64, row as f64);
            let seen = a.depth.at(column as u32, row as u32).and_then(|depth_m| {
                let p_b = t_b_a.apply(&a.camera.unproject(x, y, f64::from(depth_m)));
                let pixel = b.camera.project(&p_b).filter(|p| p.x >= 0.0 && p.y >= 0.0)?;
                let measured_m = b.depth.at(pixel.x.round() as u32, pixel.y.round() as u32)?;
                views::agrees(p_b.z, f64::from(measured_m)).then_some((pixel.x, pixel.y))
            });
            points.extend(seen.map(|pixel| ((x, y), pixel)));
        }
    }
    points
}

fn paste(sheet: &mut RgbImage, view: &View, corner: (u32, u32)) {
    let (w, h) = (view.rgb.width(), view.rgb.height());
    let picture = RgbImage::from_raw(w, h, view.rgb.data().to_vec()).unwrap();
    image::imageops::replace(sheet, &picture, i64::from(corner.0), i64::from(corner.1));
}

fn line(sheet: &mut RgbImage, from: (f64, f64), to: (f64, f64), colour: Rgb<u8>) {
    let steps = (to.0 - from.0).abs().max((to.1 - from.1).abs()).ceil().max(1.0);
    for k in 0..=steps as u32 {
        let s = f64::from(k) / steps;
        let (x, y) = (from.0 + s * (to.0 - from.0), from.1 + s * (to.1 - from.1));
        if (x as u32) < sheet.width() && (y as u32) < sheet.height() {
            sheet.put_pixel(x as u32, y as u32, colour);
        }
    }
}
