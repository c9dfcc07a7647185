//! The paper's table, with its figures beside ours.

use core::fmt;
use std::collections::BTreeMap;

use homing_planner::visual_target::{MultiStep, UnitStep};
use serde::{Deserialize, Serialize};

use super::bench::{Options, PairRuns};
use super::methods::Guide;
use super::pairs::{Difficulty, Published, TargetPair};
use super::run::{Finding, PairRun, Sensor};
use crate::report::wilson_95;

/// All pairs, all methods.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Report {
    /// Seed of the first flat.
    pub seed: u64,
    /// Columns and rows of the camera.
    pub image_px: (u32, u32),
    /// Its horizontal field of view, degrees.
    pub hfov_deg: f64,
    /// Views that share less were no pair.
    pub overlap_min: f64,
    /// The pairs of each difficulty.
    pub columns: Vec<Column>,
    /// What each method came to.
    pub methods: Vec<MethodReport>,
    /// Every pair, in the order of the runs.
    pub pairs: Vec<TargetPair>,
}

/// The pairs of one difficulty.
#[derive(Copy, Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Column {
    /// Which.
    pub difficulty: Difficulty,
    /// Pairs.
    pub n_pairs: usize,
    /// Mean distance from start to target, metres.
    pub distance_m: f64,
    /// Mean difference of headings, degrees.
    pub heading_deg: f64,
    /// Mean of the overlaps.
    pub overlap: f64,
    /// Mean share of the target view that the start view sees.
    pub target_seen: f64,
    /// What the paper states.
    pub published: Published,
}

/// One method.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct MethodReport {
    /// Its name.
    pub name: String,
    /// Extractor and matcher.
    pub features: String,
    /// Pose solver.
    pub solver: String,
    /// What the camera delivered.
    pub sensor: Sensor,
    /// Per difficulty.
    pub cells: Vec<Cell>,
    /// Every pair, in the order of the pairs.
    pub runs: Vec<PairRun>,
}

/// One method on one difficulty.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Cell {
    /// Which.
    pub difficulty: Difficulty,
    /// Pairs.
    pub n_pairs: usize,
    /// Share of successes, 0 to 1.
    pub success_rate: f64,
    /// Its 95 % interval (Wilson 1927).
    pub success_rate_95: (f64, f64),
    /// Mean distance at the end, metres; as in the paper, a failure counts with its initial one.
    pub final_distance_m: f64,
    /// Mean difference of headings at the end, degrees; likewise.
    pub final_heading_deg: f64,
    /// Median distance at the end of the successes, metres.
    pub success_distance_m_median: Option<f64>,
    /// Median difference of headings at the end of the successes, degrees.
    pub success_heading_deg_median: Option<f64>,
    /// What lost the failures; nothing where the first look does not decide.
    pub losses: BTreeMap<Loss, usize>,
}

/// What lost a pair.
#[derive(Copy, Clone, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Loss {
    /// One of the views has next to no keypoints.
    NoTexture,
    /// Fewer matches than any pose needs.
    TooFewMatches,
    /// No pose that enough matches agree on and the view bears out.
    NoConsensus,
    /// The pose at the first look was wrong by more than a metre or 30 degrees.
    WrongPlace,
    /// It was about right, and not precise enough.
    Imprecise,
    /// The estimate was right, and the robot ended elsewhere.
    NotReached,
}

impl Loss {
    /// For tables.
    #[must_use]
    pub fn words(self) -> &'static str {
        match self {
            Self::NoTexture => "no keypoints",
            Self::TooFewMatches => "too few matches",
            Self::NoConsensus => "no pose agreed on",
            Self::WrongPlace => "wrong place",
            Self::Imprecise => "imprecise",
            Self::NotReached => "right, not reached",
        }
    }

    /// Judged by the first look, from which all else follows.
    fn of(run: &PairRun) -> Option<Self> {
        let first = run.looks.first().filter(|_| !run.success)?;
        Some(match (first.finding, first.error_m, first.error_deg) {
            (Finding::NoTexture, ..) => Self::NoTexture,
            (Finding::TooFewMatches, ..) => Self::TooFewMatches,
            (Finding::Pose | Finding::Bearing, Some(m), Some(deg)) => match (m, deg) {
                _ if m < super::run::SUCCESS_M && deg < super::run::SUCCESS_DEG => Self::NotReached,
                _ if m < 1.0 && deg < 30.0 => Self::Imprecise,
                _ => Self::WrongPlace,
            },
            _ => Self::NoConsensus,
        })
    }
}

impl Report {
    /// From all runs.
    #[must_use]
    pub fn new(options: &Options, runs: Vec<PairRuns>) -> Self {
        let camera = &options.pairs.camera;
        let pairs: Vec<TargetPair> = runs.iter().map(|(pair, _)| *pair).collect();
        let rows = options.pipelines.iter().flat_map(|pipeline| pipeline.ways().iter().map(move |way| (pipeline, way)));
        let methods = rows.enumerate().map(|(k, (pipeline, way))| {
            let of_method: Vec<(&TargetPair, &PairRun)> = runs.iter().map(|(pair, runs)| (pair, &runs[k])).collect();
            MethodReport {
                name: format!("{}, {}", pipeline.name, way.name),
                features: format!("{} + {}", pipeline.features.extractor.name(), pipeline.features.matcher.name()),
                solver: format!("{:?}", pipeline.solver),
                sensor: way.sensor,
                cells: Difficulty::ALL.map(|d| Cell::of(d, &of_method, way.guide != Guide::Planner)).to_vec(),
                runs: of_method.iter().map(|(_, run)| (*run).clone()).collect(),
            }
        });
        Self {
            seed: options.pairs.seed,
            image_px: (camera.width, camera.height),
            hfov_deg: camera.hfov_rad.to_degrees(),
            overlap_min: options.pairs.overlap_min,
            columns: Difficulty::ALL.map(|d| Column::of(d, &pairs)).to_vec(),
            methods: methods.collect(),
            pairs,
        }
    }

    /// As JSON, indented.
    ///
    /// # Errors
    /// None that its own types can cause; the serialiser's are handed on.
    pub fn to_json(&self) -> serde_json::Result<String> {
        serde_json::to_string_pretty(self)
    }
}

impl Column {
    fn of(difficulty: Difficulty, pairs: &[TargetPair]) -> Self {
        let pairs: Vec<&TargetPair> = pairs.iter().filter(|p| p.difficulty == difficulty).collect();
        let of = |value: fn(&TargetPair) -> f64| mean(pairs.iter().map(|p| value(p)));
        Self {
            difficulty,
            n_pairs: pairs.len(),
            distance_m: of(TargetPair::distance_m),
            heading_deg: of(TargetPair::heading_deg),
            overlap: of(|p| p.overlap),
            target_seen: of(|p| p.target_seen),
            published: difficulty.published(),
        }
    }
}

impl Cell {
    /// `lost_at_once`: the first look decides what loses a pair.
    fn of(difficulty: Difficulty, runs: &[(&TargetPair, &PairRun)], lost_at_once: bool) -> Self {
        let runs: Vec<_> = runs.iter().filter(|(pair, _)| pair.difficulty == difficulty).collect();
        let won: Vec<&PairRun> = runs.iter().map(|(_, run)| *run).filter(|run| run.success).collect();
        let masked = |run: fn(&PairRun) -> f64, pair: fn(&TargetPair) -> f64| {
            mean(runs.iter().map(|(p, r)| if r.success { run(r) } else { pair(p) }))
        };
        let mut losses = BTreeMap::new();
        for loss in runs.iter().filter(|_| lost_at_once).filter_map(|(_, run)| Loss::of(run)) {
            *losses.entry(loss).or_insert(0) += 1;
        }
        Self {
            difficulty,
            n_pairs: runs.len(),
            success_rate: won.len() as f64 / runs.len().max(1) as f64,
            success_rate_95: wilson_95(won.len(), runs.len()),
            final_distance_m: masked(|r| r.final_distance_m, TargetPair::distance_m),
            final_heading_deg: masked(|r| r.final_heading_deg, TargetPair::heading_deg),
            success_distance_m_median: crate::report::median(won.iter().map(|r| r.final_distance_m).collect()),
            success_heading_deg_median: crate::report::median(won.iter().map(|r| r.final_heading_deg).collect()),
            losses,
        }
    }
}

fn mean(values: impl ExactSizeIterator<Item = f64>) -> f64 {
    let n = values.len().max(1) as f64;
    values.sum::<f64>() / n
}

/// Width of the first column of the table.
const NAME: usize = 44;

impl fmt::Display for Report {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let line = |f: &mut fmt::Formatter<'_>, name: &str, cells: Vec<String>| {
            writeln!(f, "{name:NAME$}{}", cells.iter().map(|c| format!("{c:>24}")).collect::<String>().trim_end())
        };
        let columns = |cell: &dyn Fn(&Column) -> String| self.columns.iter().map(cell).collect::<Vec<_>>();
        line(f, "", columns(&|c| c.difficulty.name().to_owned()))?;
        line(f, "pairs (paper: 60 in all)", columns(&|c| c.n_pairs.to_string()))?;
        let beside = |ours: f64, paper: f64, unit: &str| format!("{ours:.2} (paper {paper:.2}) {unit}");
        line(f, "mean initial distance", columns(&|c| beside(c.distance_m, c.published.distance_m, "m  ")))?;
        line(f, "mean initial viewpoint error", columns(&|c| beside(c.heading_deg, c.published.heading_deg, "deg")))?;
        line(f, "mean overlap", columns(&|c| format!("{:.0} %", 100.0 * c.overlap)))?;
        line(
            f,
            "  share of the target view seen at the start",
            columns(&|c| format!("{:.0} %", 100.0 * c.target_seen)),
        )?;
        writeln!(f, "\nsuccess: ends within 0.5 m and 10 deg (95 % interval)")?;
        line(
            f,
            "  PAPER: R2D2, PnP RANSAC, one step",
            columns(&|c| format!("{:.0} %", 100.0 * c.published.success_rate)),
        )?;
        for method in &self.methods {
            line(f, &format!("  {}", method.name), method.cells.iter().map(Cell::success).collect())?;
        }
        writeln!(f, "\nmean final distance and viewpoint error, failures at their initial ones, as in the paper")?;
        let ends = |m: f64, deg: f64| format!("{m:.2} m {deg:6.2} deg");
        let paper = |c: &Column| ends(c.published.final_distance_m, c.published.final_heading_deg);
        line(f, "  PAPER", columns(&paper))?;
        for method in &self.methods {
            let cells = method.cells.iter().map(|c| ends(c.final_distance_m, c.final_heading_deg)).collect();
            line(f, &format!("  {}", method.name), cells)?;
        }
        writeln!(f, "\nmedian error of the successes")?;
        for method in &self.methods {
            let of = |c: &Cell| match (c.success_distance_m_median, c.success_heading_deg_median) {
                (Some(m), Some(deg)) => format!("{m:.3} m {deg:6.2} deg"),
                _ => "-".to_owned(),
            };
            line(f, &format!("  {}", method.name), method.cells.iter().map(of).collect())?;
        }
        writeln!(f, "\nwhat lost the others, by the first look")?;
        for method in self.methods.iter().filter(|m| m.cells.iter().any(|c| !c.losses.is_empty())) {
            let of = |c: &Cell| {
                c.losses.iter().map(|(loss, n)| format!("{n} {}", loss.words())).collect::<Vec<_>>().join(", ")
            };
            let cells: Vec<String> =
                method.cells.iter().map(|c| format!("{}: {}", c.difficulty.name(), of(c))).collect();
            writeln!(f, "  {}: {}", method.name, cells.join("; "))?;
        }
        writeln!(f, "\n{}", self.caption())
    }
}

impl Cell {
    fn success(&self) -> String {
        let percent = |x: f64| 100.0 * x;
        let (low, high) = self.success_rate_95;
        format!("{:3.0} % ({:2.0} to {:3.0})", percent(self.success_rate), percent(low), percent(high))
    }
}

impl Report {
    /// What was measured, and how, in words.
    fn caption(&self) -> String {
        let (multi, unit, (width, height)) = (MultiStep::default(), UnitStep::default(), self.image_px);
        format!(
            "Camera {width}x{height}, {:.0} deg wide, level at 1.25 m (the paper states none). Overlap: the smaller of the\n\
             shares of either view that the other sees, at least {:.0} % (the paper assumes an overlapping region). Start\n\
             and target stand free; nothing else was asked of a pair. One step: the robot is put at the estimated pose,\n\
             or at the nearest free place on the straight way there. Multi-step: up to {} times, until a correction is\n\
             below {} m and {:.0} deg. Unit steps of {} m, halved when the direction turns around, until {} m or until\n\
             parallax is too small to tell a direction. With map and search: the planner drives, as in `homing bench`.",
            self.hfov_deg,
            100.0 * self.overlap_min,
            multi.moves_max,
            multi.settled_m,
            multi.settled_rad.to_degrees(),
            unit.step_m,
            unit.step_m_min
        )
    }
}

#[cfg(test)]
mod tests {
    use homing_sim::episode::{FloorPose, Viewpoint};

    use super::super::methods::{Pipeline, Solver};
    use super::super::pairs::PairSpec;
    use super::*;

    fn pair(difficulty: Difficulty, distance_m: f64) -> TargetPair {
        let start = FloorPose { x_m: 0.0, y_m: 0.0, yaw_rad: 0.0 };
        let target = FloorPose { x_m: distance_m, y_m: 0.0, yaw_rad: 0.5 };
        TargetPair { difficulty, flat: 1, start, target, overlap: 0.2, target_seen: 0.4, start_seen: 0.2 }
    }

    fn run(final_distance_m: f64, finding: Finding, error_m: Option<f64>) -> PairRun {
        let look = super::super::run::LookRecord {
            finding,
            n_matches: 9,
            n_inliers: 8,
            distance_m: 2.0,
            heading_deg: 30.0,
            error_m,
            error_deg: error_m.map(|_| 1.0),
        };
        let end = FloorPose { x_m: 0.0, y_m: 0.0, yaw_rad: 0.0 };
        let success = final_distance_m < 0.5;
        PairRun { success, final_distance_m, final_heading_deg: 1.0, ending: String::new(), end, looks: vec![look] }
    }

    #[test]
    fn failures_count_with_their_initial_errors_and_their_cause() {
        let pairs = PairSpec { n_each: 2, seed: 1, camera: Viewpoint::default(), overlap_min: 0.1 };
        let (features, solver) = (Default::default(), Solver::Ours);
        let pipeline = Pipeline { name: "SIFT".to_owned(), features, solver, planner: false };
        let options = Options { pairs, pipelines: vec![pipeline], threads: 1 };
        let good = run(0.1, Finding::Pose, Some(0.1));
        let wrong = run(3.0, Finding::Pose, Some(4.0));
        let blind = run(2.0, Finding::NoConsensus, None);
        let rows = vec![
            (pair(Difficulty::Moderate, 2.0), vec![good.clone(), good.clone(), wrong]),
            (pair(Difficulty::Moderate, 3.0), vec![blind, good, run(3.0, Finding::TooFewMatches, None)]),
        ];
        let report = Report::new(&options, rows);
        assert!((report.columns[0].distance_m - 2.5).abs() < 1e-12);
        let cell = |k: usize| &report.methods[k].cells[0];
        assert_eq!(cell(0).success_rate, 0.5);
        assert!((cell(0).final_distance_m - 1.55).abs() < 1e-12, "0.1 of the success, 3 of the failure");
        assert_eq!(cell(0).losses, BTreeMap::from([(Loss::NoConsensus, 1)]));
        assert_eq!(cell(1).success_rate, 1.0);
        assert_eq!(cell(2).losses, BTreeMap::from([(Loss::WrongPlace, 1), (Loss::TooFewMatches, 1)]));
        let table = report.to_string();
        assert!(table.contains("2.50 (paper 2.23)") && table.contains("SIFT, multi-step"), "{table}");
    }
}
