//! A small real run of perception's benchmark, on two flats.

#![expect(clippy::unwrap_used, reason = "a test may fail by panicking")]

use std::sync::atomic::{AtomicUsize, Ordering};

use homing_benchmark::perception::{
    Class, Finding, MeasureOptions, Measured, PairKind, PairSource, PerceptionReport, ReportPlan, Setup,
    SimulatedPairs, measure, plots, time_stages,
};
use homing_perception::onnx::FeatureChoice;
use homing_perception::{PerceptionConfig, PoseSolver};
use homing_sim::views::{Cameras, ViewSpec};

/// Two units: two flats, and one alone.
fn source() -> SimulatedPairs {
    SimulatedPairs {
        seeds: 300_000..300_003,
        spec: ViewSpec { n_views: 5, width: 320, height: 240 },
        cameras: Cameras::ROBOT,
    }
}

fn setups() -> Vec<Setup> {
    let setup = |name: &str, solver| Setup {
        name: name.to_owned(),
        features: FeatureChoice::default(),
        perception: PerceptionConfig { solver, ..PerceptionConfig::default() },
    };
    vec![setup("ours", PoseSolver::LoRansac), setup("papers", PoseSolver::EpnpRansac)]
}

fn run(threads: usize, n_decided: Option<usize>, heard: &AtomicUsize) -> Measured {
    let hear = |n| {
        heard.fetch_add(n, Ordering::Relaxed);
    };
    measure(&source(), &setups()[..1], &MeasureOptions { threads, n_decided }, &hear).unwrap()
}

#[test]
fn pairs_are_of_all_kinds_and_balanced() {
    let source = source();
    let unit = source.unit(0).unwrap();
    assert_eq!((source.n_units(), unit.frames.len()), (2, 10));
    let count = |kind| unit.pairs.iter().filter(|p| p.facts.kind == kind).count();
    assert!(count(PairKind::Seen) >= 6 && count(PairKind::Seen) == count(PairKind::Turned));
    let n = |view| unit.pairs.iter().filter(|p| p.facts.goal_in_view() == Some(view)).count();
    assert_eq!(count(PairKind::Elsewhere) + count(PairKind::Unseen), n(false));
    assert!(n(true).abs_diff(n(false)) <= 2, "{} with, {} without the goal in view", n(true), n(false));
    for pair in &unit.pairs {
        let truth = unit.truth(pair);
        assert_eq!(truth.is_none(), pair.facts.kind == PairKind::Elsewhere);
        assert!(truth.is_none_or(|t| (t.translation().norm() - pair.facts.distance_m.unwrap()).abs() < 1e-9));
    }
}

#[test]
fn threads_change_nothing_and_enough_pairs_end_a_run() {
    let heard = AtomicUsize::new(0);
    let all = run(2, None, &heard);
    assert_eq!(heard.into_inner(), all.n_decided());
    let first = run(1, Some(1), &AtomicUsize::new(0));
    assert!(first.pairs.len() < all.pairs.len(), "the first unit is enough");
    assert_eq!(first.pairs[..], all.pairs[..first.pairs.len()]);
    assert_eq!(first.findings[0][..], all.findings[0][..first.pairs.len()]);
    what_is_in_view_is_found_and_nothing_else(&all);
}

fn what_is_in_view_is_found_and_nothing_else(measured: &Measured) {
    let of = |kinds: &[PairKind]| {
        let both = measured.pairs.iter().zip(&measured.findings[0]);
        both.filter(|(p, _)| kinds.contains(&p.kind)).map(|(_, f)| *f).collect::<Vec<Finding>>()
    };
    let good = |f: &Finding| f.error().is_some_and(|e| e.position_m < 0.25 && e.rotation_deg < 10.0);
    let seen = of(&[PairKind::Seen, PairKind::Turned]);
    let n_good = seen.iter().filter(|f| good(f)).count();
    assert!(2 * n_good > seen.len(), "{n_good} of {}", seen.len());
    let n_wrong = of(&[PairKind::Elsewhere]).iter().filter(|f| f.pose().is_some()).count();
    assert_eq!(n_wrong, 0, "poses in flats that were never seen");
}

#[test]
fn a_report_has_tables_pictures_and_json() {
    let one = SimulatedPairs { seeds: 300_000..300_001, ..source() };
    let options = MeasureOptions { threads: 1, n_decided: None };
    let measured = measure(&one, &setups(), &options, &|_| {}).unwrap();
    let stages = time_stages(&one, &setups(), 1, 3).unwrap();
    assert!(stages.iter().all(|s| s.n == 3 && s.extract_ms.p50 > 0.0 && s.total_ms.p95 >= s.total_ms.p50));
    let plan = ReportPlan {
        set: "one flat".to_owned(),
        classes: vec![Class::Headline, Class::All],
        compared: vec![Class::Headline],
        with_switches: true,
        threads: 2,
    };
    let report = PerceptionReport::new(&plan, &setups(), &measured, &stages);
    let back: PerceptionReport = serde_json::from_str(&report.to_json().unwrap()).unwrap();
    assert_eq!(back.comparisons.len(), 3);
    assert_eq!(
        back.configurations[1].accuracy[1].within[0].n_hits,
        report.configurations[1].accuracy[1].within[0].n_hits
    );
    let text = report.to_string();
    for words in ["one flat", "papers", "overlap >= 0.3", "explore to exploit", "ms a frame", "McNemar"] {
        assert!(text.contains(words), "{words} is missing in\n{text}");
    }
    let pictures = plots(&report, &measured, &Class::Headline).unwrap();
    assert_eq!(pictures.len(), 5);
    assert!(pictures.iter().all(|p| p.svg.starts_with("<svg") && p.svg.contains("papers")));
}
