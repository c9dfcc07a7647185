//! The report as pictures: SVG, as text.

mod bars;
mod curves;
mod style;

use super::accuracy::{Accuracy, Class, TOLERANCES, angular_error_deg};
use super::measure::Measured;
use super::report::{PerceptionReport, of_class};
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
    let mut all = vec![Plot { name: "error_curve.svg", svg: error_curves(report, measured, class)? }];
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

fn error_curves(report: &PerceptionReport, measured: &Measured, class: &Class) -> Result<String, PlotError> {
    let curve = |(i, name): (usize, &String)| {
        let findings = of_class(&measured.pairs, &measured.findings[i], class);
        Curve { name: name.clone(), errors: findings.iter().map(angular_error_deg).collect() }
    };
    let names: Vec<String> = report.configurations.iter().map(|c| c.name.clone()).collect();
    let curves: Vec<Curve> = names.iter().enumerate().map(curve).collect();
    let n = curves.first().map_or(0, |c| c.errors.len());
    Curves {
        title: "Pairs with a pose error below ...",
        subtitle: &format!("{n} pairs: {}", class.words()),
        x_axis: "greater of rotation and direction error, degrees",
        x_max: 20.0,
        curves: &curves,
    }
    .draw()
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
        bars: all.iter().map(|s| (of(s).p50, of(s).p95)).map(|(p50, p95)| Bar { value: p50, low: p50, high: p95 }).collect(),
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
