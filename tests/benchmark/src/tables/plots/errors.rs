//! How near the robots ended, as shares of episodes below an error.

use super::picture::{Axis, Lines, Mark, Picture};
use crate::perception::plots::style::colour;
use crate::tables::episodes::{Episodes, finite};
use crate::tables::rows;

/// Errors at the end of one row on one set, ascending.
#[derive(Clone, Debug, PartialEq)]
pub(in crate::tables) struct FinalErrors {
    pub row: String,
    pub set: String,
    /// Episodes.
    pub n: usize,
    /// Of all episodes, geodesic, metres.
    pub distance_m: Vec<f64>,
    /// Of the successes, degrees.
    pub heading_deg: Vec<f64>,
    /// Successes.
    pub n_success: usize,
}

pub(in crate::tables) fn final_errors(episodes: &Episodes<'_>) -> Vec<FinalErrors> {
    let sorted = |mut values: Vec<f64>| {
        values.sort_by(f64::total_cmp);
        values
    };
    episodes
        .headlines()
        .into_iter()
        .map(|(row, set)| {
            let group = episodes.of(row, set);
            let won = || group.values().filter(|e| e.strict.success);
            FinalErrors {
                row: row.to_owned(),
                set: set.to_owned(),
                n: group.len(),
                distance_m: sorted(finite(group.values().map(|e| e.strict.final_distance_m))),
                heading_deg: sorted(finite(won().map(|e| e.strict.final_heading_error_deg))),
                n_success: won().count(),
            }
        })
        .collect()
}

const POSITION_LABELS_M: [f64; 8] = [0.05, 0.1, 0.2, 0.5, 1.0, 2.0, 5.0, 10.0];
const HEADING_LABELS_DEG: [f64; 7] = [0.2, 0.5, 1.0, 5.0, 15.0, 45.0, 180.0];

/// Distance to the goal at the end, all episodes.
pub(in crate::tables) fn positions(set: &str, all: &[FinalErrors]) -> Option<Picture> {
    let curves = curves(set, all, &|e| (&e.distance_m, e.n));
    let subtitle = "share of all episodes that ended nearer than this; line: success".to_owned();
    let mut picture = picture(curves, &POSITION_LABELS_M, "distance to the goal at the end, metres")?;
    picture.marks.push(Mark::Limit { x: libm::log10(homing_sim::constants::SUCCESS_M) });
    Some(Picture { title: format!("Distance at the end, {set}"), subtitle, ..picture })
}

/// Difference of headings at the end, successes.
pub(in crate::tables) fn heading_errors(set: &str, all: &[FinalErrors]) -> Option<Picture> {
    let curves = curves(set, all, &|e| (&e.heading_deg, e.n_success));
    let subtitle = "share of the successes that ended with a smaller error".to_owned();
    let picture = picture(curves, &HEADING_LABELS_DEG, "difference from the photo's heading, degrees")?;
    Some(Picture { title: format!("Heading at the end, {set}"), subtitle, ..picture })
}

/// A name, its errors, and of how many they are.
type Curve<'a> = (String, &'a [f64], usize);

fn curves<'a>(
    set: &str,
    all: &'a [FinalErrors],
    errors: &dyn Fn(&'a FinalErrors) -> (&'a Vec<f64>, usize),
) -> Vec<Curve<'a>> {
    let of_set = all.iter().filter(|e| e.set == set);
    let curve = |e: &'a FinalErrors| {
        let (values, n) = errors(e);
        (rows::name(&e.row), values.as_slice(), n)
    };
    of_set.map(curve).filter(|(_, values, _)| !values.is_empty()).collect()
}

/// On a logarithmic axis that the labels span.
fn picture(curves: Vec<Curve<'_>>, labels: &[f64], name: &str) -> Option<Picture> {
    let (from, to) = (libm::log10(*labels.first()?), libm::log10(*labels.last()?));
    let line = |(i, (_, errors, n)): (usize, &Curve<'_>)| Mark::Line {
        points: steps(errors, *n, (from, to)),
        colour: colour(i),
    };
    if curves.is_empty() {
        return None;
    }
    Some(Picture {
        title: String::new(),
        subtitle: String::new(),
        x: Axis {
            name: name.to_owned(),
            from,
            to,
            labels: labels.iter().map(|x| (libm::log10(*x), x.to_string())).collect(),
            lines: Lines::Drawn,
        },
        y: Axis::percent("percent"),
        marks: curves.iter().enumerate().map(line).collect(),
        legend: curves.iter().enumerate().map(|(i, (name, ..))| (name.clone(), colour(i))).collect(),
    })
}

/// Corners of the climbing curve, x as logarithm, y in percent.
fn steps(errors: &[f64], n: usize, (from, to): (f64, f64)) -> Vec<(f64, f64)> {
    let percent = |k: usize| 100.0 * k as f64 / n.max(1) as f64;
    let log = |x: f64| libm::log10(x.max(1e-9));
    let before = errors.iter().filter(|e| log(**e) <= from).count();
    let within = errors.iter().filter(|e| log(**e) < to).count();
    let mut corners = vec![(from, percent(before))];
    for (k, error) in errors.iter().enumerate().take(within).skip(before) {
        corners.extend([(log(*error), percent(k)), (log(*error), percent(k + 1))]);
    }
    corners.push((to, percent(within)));
    corners
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_curve_climbs_at_every_error_and_ends_below_where_episodes_ended_far_away() {
        // On an axis from 0.1 to 10: one at 0.05, one at 1, one at 100, one that is no number.
        let corners = steps(&[0.05, 1.0, 100.0], 4, (-1.0, 1.0));
        assert_eq!(corners, [(-1.0, 25.0), (0.0, 25.0), (0.0, 50.0), (1.0, 50.0)]);
    }
}
