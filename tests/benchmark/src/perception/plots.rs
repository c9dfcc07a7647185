//! The report as pictures: SVG, as text.

mod bars;
mod curves;
pub(crate) mod style;

use super::accuracy::{Accuracy, Class, TOLERANCES, angular_error_deg};
use super::findings::Finding;
use super::measure::Measured;
use super::report::{ConfigurationReport, PerceptionReport, of_class};
use bars::{Bar, Bars, Group};
use curves::{Curve, Curves};
pub use style::PlotError;

/// A picture and the name of its file.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Plot {
    /// Name of the file.
    pub name: &'static str,
    /// SVG.
    pub svg: String,
}

/// All pictures of a report. `class` is the one whose error curves are drawn.
///
/// # Errors
/// [`PlotError`] when a picture cannot be drawn.
pub fn plots(report: &PerceptionReport, measured: &Measured, class: &Class) -> Result<Vec<Plot>, PlotError> {
    let angle = (
        "Pairs whose angle error is below x",
        "greater of rotation and direction error, degrees",
        &ANGLE_LABELS_DEG[..],
    );
    let position = ("Pairs whose position error is below x", "position error, metres", &POSITION_LABELS_M[..]);
    let position_m = |f: &Finding| f.error().map_or(f64::INFINITY, |e| e.position_m);
    let mut all = vec![
        Plot { name: "angle_error.svg", svg: error_curves(report, measured, class, angle, angular_error_deg)? },
        Plot { name: "position_error.svg", svg: error_curves(report, measured, class, position, position_m)? },
    ];
    for (name, title, classes) in [
        ("success_by_overlap.svg", "by what the two views share", Class::by_overlap()),
        ("success_by_turn.svg", "by how far the camera was turned", Class::by_turn()),
    ] {
        all.push(Plot { name, svg: success(report, measured, title, &classes)? });
    }
    if report.configurations.iter().all(|c| c.stages.is_some()) {
        all.push(Plot { name: "stages.svg", svg: stages(report)? });
    }
    Ok(all)
}

const ANGLE_LABELS_DEG: [f64; 9] = [0.05, 0.1, 0.2, 0.5, 1.0, 2.0, 5.0, 10.0, 20.0];
const POSITION_LABELS_M: [f64; 10] = [0.002, 0.005, 0.01, 0.02, 0.05, 0.1, 0.2, 0.5, 1.0, 2.0];

fn error_curves(
    report: &PerceptionReport,
    measured: &Measured,
    class: &Class,
    (title, x_axis, x_labels): (&str, &str, &[f64]),
    error: impl Fn(&Finding) -> f64,
) -> Result<String, PlotError> {
    let curve = |(i, c): (usize, &ConfigurationReport)| Curve {
        name: c.name.clone(),
        errors: of_class(&measured.pairs, &measured.findings[i], class).iter().map(&error).collect(),
    };
    let curves: Vec<Curve> = report.configurations.iter().enumerate().map(curve).collect();
    let n = curves.first().map_or(0, |c| c.errors.len());
    let subtitle = format!("{n} pairs: {}; a curve ends below 100 where no pose was found", class.words());
    Curves { title, subtitle: &subtitle, x_axis, x_labels, curves: &curves }.draw()
}

/// The middle one of the tolerances: fine enough to arrive, coarse enough to tell weak configurations apart.
const SHOWN: usize = 1;

fn success(
    report: &PerceptionReport,
    measured: &Measured,
    title: &str,
    classes: &[Class],
) -> Result<String, PlotError> {
    let group = |class: &Class| {
        let of = |i: usize| Accuracy::of(class, &of_class(&measured.pairs, &measured.findings[i], class));
        let accuracies: Vec<Accuracy> = (0..measured.findings.len()).map(of).collect();
        let n = accuracies.first().map_or(0, |a| a.n);
        let bar = |a: &Accuracy| {
            let s = a.within[SHOWN];
            Bar { value: 100.0 * s.share, low: 100.0 * s.interval_95.0, high: 100.0 * s.interval_95.1 }
        };
        Group {
            label: class.words(),
            detail: format!("{n} pairs"),
            bars: if n == 0 { Vec::new() } else { accuracies.iter().map(bar).collect() },
        }
    };
    Bars {
        title: &format!("Pairs within {}, {title}", TOLERANCES[SHOWN].words()),
        subtitle: "bars: share of pairs; lines: 95 % interval",
        y_axis: "percent of pairs",
        y_max: Some(100.0),
        names: &report.configurations.iter().map(|c| c.name.clone()).collect::<Vec<_>>(),
        groups: &classes.iter().map(group).collect::<Vec<_>>(),
    }
    .draw()
}

fn stages(report: &PerceptionReport) -> Result<String, PlotError> {
    let all: Vec<_> = report.configurations.iter().filter_map(|c| c.stages).collect();
    let threads = all.first().map_or(0, |s| s.threads);
    let n = all.first().map_or(0, |s| s.n);
    let group = |(label, of): (&str, fn(&super::stages::StageReport) -> super::stages::Milliseconds)| Group {
        label: label.to_owned(),
        detail: String::new(),
        bars: all
            .iter()
            .map(|s| (of(s).p50, of(s).p95))
            .map(|(p50, p95)| Bar { value: p50, low: p50, high: p95 })
            .collect(),
    };
    let groups = [
        group(("extract", |s| s.extract_ms)),
        group(("match", |s| s.match_ms)),
        group(("pose", |s| s.pose_ms)),
        group(("all three", |s| s.total_ms)),
    ];
    Bars {
        title: "Time per stage for one frame",
        subtitle: &format!("bars: median of {n} frames, {threads} threads; lines: to the 95th percentile"),
        y_axis: "milliseconds",
        y_max: None,
        names: &report.configurations.iter().map(|c| c.name.clone()).collect::<Vec<_>>(),
        groups: &groups,
    }
    .draw()
}
