//! The report as people read it in a terminal.

use core::fmt;

use super::accuracy::{Accuracy, TOLERANCES};
use super::pairs::IN_VIEW_OVERLAP_MIN;
use super::report::{Comparison, ConfigurationReport, PerceptionReport};
use super::stages::{Milliseconds, StageReport};
use super::statistics::Share;
use super::switch_accuracy::{Decisions, SwitchAccuracy};

impl fmt::Display for PerceptionReport {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        writeln!(f, "{}", self.set)?;
        writeln!(f, "{} pairs; accuracy on {} of them, each two views once", self.n_pairs, self.n_for_accuracy)?;
        for configuration in &self.configurations {
            writeln!(f, "\n{}", configuration.name)?;
            accuracy_table(f, &configuration.accuracy)?;
        }
        writeln!(f, "\n{ACCURACY_CAPTION}")?;
        self.switch_table(f)?;
        if !self.comparisons.is_empty() {
            writeln!(f, "\nshare of the other minus share of {}, on the same pairs", self.comparisons[0].first)?;
            self.comparisons.iter().try_for_each(|c| comparison_row(f, c))?;
            writeln!(f, "{COMPARISON_CAPTION}")?;
        }
        self.stage_table(f)?;
        if let Some(mb) = self.peak_memory_mb {
            writeln!(f, "\nmost memory at a time: {mb:.0} MB, all of the above, images and the simulator included")?;
        }
        Ok(())
    }
}

const ACCURACY_CAPTION: &str = "\
AUC: area under the share of pairs whose greater of rotation and direction error is below x, to 5, 10 and 20 degrees.
In brackets: 95 % interval (Wilson). No pose, or a bearing alone, has failed. Medians over all pairs: - where half failed.";

const COMPARISON_CAPTION: &str = "\
In brackets: 95 % interval, bootstrap that draws whole flats (of recordings: single pairs); p: McNemar's exact test.";

fn share(s: &Share) -> String {
    format!("{:.3} ({:.3} to {:.3})", s.share, s.interval_95.0, s.interval_95.1)
}

fn accuracy_table(f: &mut fmt::Formatter<'_>, rows: &[Accuracy]) -> fmt::Result {
    let [a, b, c] = TOLERANCES.map(|t| t.words());
    writeln!(f, "  {:34}{:>6}  AUC @5   @10   @20  {a:24}{b:24}{c:24}medians", "", "pairs")?;
    for row in rows.iter().filter(|row| row.n > 0) {
        let medians = match (row.position_m_median, row.rotation_deg_median) {
            (Some(m), Some(deg)) => format!("{m:.3} m  {deg:.2} deg"),
            _ => "-".to_owned(),
        };
        let [a, b, c] = row.within.map(|s| share(&s));
        writeln!(
            f,
            "  {:34}{:>6}    {:.3}  {:.3}  {:.3}  {a:24}{b:24}{c:24}{}",
            row.class, row.n, row.auc[0], row.auc[1], row.auc[2], medians,
        )?;
    }
    Ok(())
}

impl PerceptionReport {
    fn switch_table(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let with = |c: &ConfigurationReport| Some((c.name.clone(), c.switches?));
        let all: Vec<(String, SwitchAccuracy)> = self.configurations.iter().filter_map(with).collect();
        let Some((_, first)) = all.first() else { return Ok(()) };
        let n = first.explore_to_exploit.right.n;
        writeln!(
            f,
            "\n{:51}right in all           goal in view           not in view",
            format!("switches on {n} pairs")
        )?;
        for (name, s) in &all {
            switch_row(f, name, "explore to exploit", &s.explore_to_exploit)?;
            switch_row(f, name, "exploit to explore", &s.exploit_to_explore)?;
        }
        writeln!(
            f,
            "Goal in view: the views share {IN_VIEW_OVERLAP_MIN} and more, and are nearer than {d} m; not in view: they \
             share less than 0.1, are farther apart, or are of\ntwo flats (half of these). In between either answer is \
             right: not counted. Explore to exploit: a pose with {n} inliers or more, nearer than {d} m. Exploit\nto \
             explore: no pose, or one farther away. Wrong place: off by more than 1 m or 30 degrees. SLING, on pairs of \
             its own: .920 and .841.",
            d = first.distance_m_max,
            n = first.n_inliers_min,
        )
    }

    fn stage_table(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let with = |c: &ConfigurationReport| Some((c.name.clone(), c.stages?));
        let all: Vec<(String, StageReport)> = self.configurations.iter().filter_map(with).collect();
        let Some((_, first)) = all.first() else { return Ok(()) };
        writeln!(
            f,
            "\n{:50}{:>16}{:>16}{:>16}{:>16}",
            format!("ms a frame, p50 (p95) of {} frames, {} threads", first.n, first.threads),
            "extract",
            "match",
            "pose",
            "total"
        )?;
        for (name, s) in &all {
            let cell = |m: &Milliseconds| format!("{:.1} ({:.1})", m.p50, m.p95);
            let [a, b, c, d] = [&s.extract_ms, &s.match_ms, &s.pose_ms, &s.total_ms].map(cell);
            writeln!(f, "  {name:48}{a:>16}{b:>16}{c:>16}{d:>16}")?;
        }
        writeln!(f, "One after the other, the configurations in turn; the photo's features are at hand.")
    }
}

fn switch_row(f: &mut fmt::Formatter<'_>, name: &str, switch: &str, d: &Decisions) -> fmt::Result {
    writeln!(
        f,
        "  {name:30}{switch:19}{:23}{:23}{:23}{} of {} to a wrong place; {} of {} unseen to a right one",
        share(&d.right),
        share(&d.in_view),
        share(&d.not_in_view),
        d.wrong_place.n_hits,
        d.wrong_place.n,
        d.right_place_unseen.n_hits,
        d.right_place_unseen.n,
    )
}

fn comparison_row(f: &mut fmt::Formatter<'_>, c: &Comparison) -> fmt::Result {
    let d = &c.difference;
    writeln!(
        f,
        "  {:40} {:33} {:15} {:+.3} ({:+.3} to {:+.3})  only the one {}, only the other {}, of {}; p {:.4}",
        c.other,
        c.class,
        c.tolerance.words(),
        d.difference,
        d.interval_95.0,
        d.interval_95.1,
        d.n_only_first,
        d.n_only_other,
        d.n,
        d.p_mcnemar
    )
}
