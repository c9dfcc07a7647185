//! Figures that others published, each with where it stands. Nothing here was measured by us.

use serde::Serialize;

/// A row of a table of SLING or NRNS: percent of successes and SPL, times 100.
#[derive(Copy, Clone, Debug, PartialEq, Serialize)]
pub struct SlingRow {
    /// Number of the row in its table; 0 where rows are not numbered.
    pub number: u8,
    /// The method, as the source names it.
    pub method: &'static str,
    /// Success and SPL: overall, easy, medium, hard.
    pub cells: [(f64, f64); 4],
}

/// A row of the modular paper's table: success rate and SPL, 0 to 1.
#[derive(Copy, Clone, Debug, PartialEq, Serialize)]
pub struct ModularRow {
    /// The model, as the source names it.
    pub model: &'static str,
    /// Success rate and SPL: easy, medium, hard, overall.
    pub cells: [(f64, f64); 4],
}

/// A table and where it stands.
#[derive(Copy, Clone, Debug, PartialEq, Serialize)]
pub struct Table<R: 'static> {
    /// Paper and table.
    pub source: &'static str,
    /// On what episodes, counted how.
    pub protocol: &'static str,
    /// The rows.
    pub rows: &'static [R],
}

/// All of it.
#[derive(Copy, Clone, Debug, PartialEq, Serialize)]
pub struct Published {
    /// Methods on Gibson-curved.
    pub sling_1: Table<SlingRow>,
    /// Ablations on Gibson-curved.
    pub sling_2: Table<SlingRow>,
    /// The modular system.
    pub modular: Table<ModularRow>,
    /// The best on Gibson-curved since.
    pub field: Table<SlingRow>,
    /// First headings.
    pub headings: HeadingFigures,
}

/// SLING's study of first headings.
#[derive(Copy, Clone, Debug, PartialEq, Serialize)]
pub struct HeadingFigures {
    /// Paper and figure.
    pub source: &'static str,
    /// Wasserstein distance of NRNS's headings from the true ones. The unit is not stated.
    pub wasserstein_nrns: f64,
    /// The same of SLING's.
    pub wasserstein_sling: f64,
    /// Share of the true headings within 15 degrees of straight ahead, 0 to 1: in the training data ...
    pub within_15_train: f64,
    /// ... and at test time.
    pub within_15_test: f64,
}

const fn row(number: u8, method: &'static str, f: [f64; 8]) -> SlingRow {
    SlingRow { number, method, cells: [(f[0], f[1]), (f[2], f[3]), (f[4], f[5]), (f[6], f[7])] }
}

const fn modular(model: &'static str, f: [f64; 8]) -> ModularRow {
    ModularRow { model, cells: [(f[0], f[1]), (f[2], f[3]), (f[4], f[5]), (f[6], f[7])] }
}

const PROTOCOL: &str = "Gibson scans, NRNS's curved episodes, 1,000 of each level, 500 steps; success is to be within \
     1 m of the goal in a straight line, by the published code without a stop and with steps of the last mile not counted";

/// Wasserman et al. 2022, table 1.
pub const SLING_1: Table<SlingRow> = Table {
    source: "Wasserman et al., Last-Mile Embodied Visual Navigation, CoRL 2022, Table 1",
    protocol: PROTOCOL,
    rows: &[
        row(1, "BC w/ Spatial Memory", [1.3, 1.1, 3.1, 2.5, 0.8, 0.7, 0.2, 0.1]),
        row(2, "BC w/ GRU", [1.7, 1.3, 3.6, 2.8, 1.1, 0.9, 0.5, 0.3]),
        row(3, "DDPPO (from NRNS)", [15.7, 12.9, 22.2, 16.5, 20.7, 18.5, 4.2, 3.7]),
        row(4, "NRNS", [21.7, 8.1, 31.4, 10.7, 22.0, 8.2, 11.9, 5.4]),
        row(5, "ZER", [33.0, 23.6, 48.0, 34.2, 36.0, 25.9, 15.1, 10.8]),
        row(6, "OVRL", [45.6, 28.0, 53.6, 31.7, 47.6, 30.2, 35.6, 21.9]),
        row(7, "DDPPO-LMN + OVRL-GD", [44.3, 30.1, 52.4, 36.6, 48.6, 32.6, 31.9, 21.2]),
        row(8, "SLING + Straight-GD", [31.0, 12.8, 39.2, 14.3, 33.0, 14.3, 21.0, 9.9]),
        row(9, "SLING + DDPPO-GD", [37.9, 22.8, 52.2, 32.7, 42.2, 25.2, 19.4, 10.5]),
        row(10, "SLING + NRNS-GD", [43.5, 15.1, 58.7, 17.4, 47.0, 17.4, 25.0, 10.5]),
        row(11, "SLING + OVRL-GD", [54.8, 37.3, 65.4, 45.7, 59.5, 40.6, 39.6, 25.5]),
    ],
};

/// Row of [`SLING_2`] that its ablations are taken from: SLING + NRNS-GD.
pub const SLING_2_BASE: u8 = 2;

/// Wasserman et al. 2022, table 2. Rows 3 to 10 change row 2.
pub const SLING_2: Table<SlingRow> = Table {
    source: "Wasserman et al., Last-Mile Embodied Visual Navigation, CoRL 2022, Table 2",
    protocol: PROTOCOL,
    rows: &[
        row(1, "NRNS", [21.7, 8.1, 31.4, 10.7, 22.0, 8.2, 11.9, 5.4]),
        row(2, "SLING + NRNS-GD", [43.5, 15.1, 58.7, 17.4, 47.0, 17.4, 25.0, 10.5]),
        row(3, "w/ MLP Switch", [42.5, 14.8, 55.4, 16.7, 47.3, 17.3, 24.9, 10.5]),
        row(4, "w/ MLP Switch w/o Recovery", [31.5, 11.5, 45.6, 14.3, 32.8, 12.9, 16.1, 7.3]),
        row(5, "w/o Neural Features", [33.7, 11.3, 47.5, 13.5, 35.9, 13.0, 17.7, 7.5]),
        row(6, "w/ Pose Noise", [43.7, 14.3, 58.6, 16.1, 47.6, 16.8, 24.9, 10.1]),
        row(7, "w/ Pose & Depth Noise", [43.5, 14.0, 56.9, 15.9, 47.2, 15.9, 26.6, 10.3]),
        row(8, "w/ Oracle-LP", [45.1, 17.8, 60.8, 21.2, 48.7, 20.3, 25.8, 12.1]),
        row(9, "w/ Oracle-LM-Pose", [53.3, 19.3, 72.3, 23.4, 57.1, 21.6, 30.5, 13.1]),
        row(10, "w/ Oracle-LM-Pose & Oracle-LP", [53.7, 22.4, 72.6, 27.7, 57.6, 24.7, 31.0, 14.9]),
        row(11, "NRNS + Oracle-GD (upper bound)", [67.7, 60.2, 68.5, 58.4, 71.2, 63.7, 63.5, 58.7]),
        row(12, "SLING + Oracle-GD (upper bound)", [86.2, 74.8, 85.9, 72.2, 88.6, 77.7, 84.3, 74.6]),
    ],
};

/// Wu et al., table I.
pub const MODULAR: Table<ModularRow> = Table {
    source: "Wu et al., Image-Goal Navigation in Complex Environments via Modular Learning, RA-L 2022, Table I",
    protocol: "Gibson scans, 1,000 episodes of each level drawn by the length of the shortest path, 500 steps; success is \
         the agent's own stop within 1 m of the goal",
    rows: &[
        modular("Ours-RP", [0.65, 0.32, 0.51, 0.28, 0.39, 0.21, 0.51, 0.27]),
        modular("Ours-SR", [0.37, 0.21, 0.23, 0.10, 0.09, 0.01, 0.23, 0.11]),
        modular("Ours-LP", [0.61, 0.37, 0.49, 0.26, 0.31, 0.19, 0.47, 0.27]),
        modular("Ours_1", [0.73, 0.49, 0.56, 0.33, 0.43, 0.24, 0.57, 0.35]),
        modular("Random Agent", [0.36, 0.15, 0.31, 0.09, 0.11, 0.03, 0.26, 0.09]),
        modular("TD-VNM", [0.56, 0.22, 0.17, 0.06, 0.06, 0.02, 0.26, 0.10]),
        modular("G-LSTM-RL-BC", [0.53, 0.31, 0.19, 0.07, 0.04, 0.02, 0.25, 0.13]),
        modular("TD-RL-ITR", [0.68, 0.36, 0.45, 0.23, 0.19, 0.09, 0.44, 0.22]),
        modular("NTS", [0.80, 0.60, 0.47, 0.31, 0.37, 0.22, 0.55, 0.38]),
    ],
};

/// Guo et al. 2025, table 1, curved: what is best on these episodes now.
pub const FIELD: Table<SlingRow> = Table {
    source: "Guo et al., IGL-Nav, ICCV 2025 (arXiv 2508.00823), Table 1, Gibson-curved",
    protocol: "Gibson scans, NRNS's curved episodes; success within 1 m",
    rows: &[
        row(0, "FeudalNav", [60.2, 39.1, 72.5, 51.3, 64.4, 40.7, 43.7, 25.3]),
        row(0, "RNR-Map", [65.7, 40.8, 75.3, 52.5, 70.9, 42.3, 51.0, 27.4]),
        row(0, "IGL-Nav", [73.5, 62.4, 82.8, 77.7, 80.7, 70.0, 57.0, 39.6]),
    ],
};

/// Wasserman et al. 2022, section 4.3 and figure 3a.
pub const HEADINGS: HeadingFigures = HeadingFigures {
    source: "Wasserman et al., CoRL 2022, Section 4.3 and Figure 3a (with Oracle-GD)",
    wasserstein_nrns: 0.0134,
    wasserstein_sling: 0.0034,
    within_15_train: 0.722,
    within_15_test: 0.394,
};

/// The visual target paper. Its figures stand with [`crate::visual_target::Difficulty`], whose pairs are drawn after them.
pub const VISUAL_TARGET_SOURCE: &str = "Visual Target Navigation (R2D2 keypoints, PnP RANSAC), Table 1: 60 pairs in a \
     scan of a university building; one step, success within 0.5 m and 10 degrees";

impl Published {
    /// What there is.
    pub const ALL: Self =
        Self { sling_1: SLING_1, sling_2: SLING_2, modular: MODULAR, field: FIELD, headings: HEADINGS };
}

impl Table<SlingRow> {
    /// The row of a number.
    #[must_use]
    pub fn numbered(&self, number: u8) -> Option<&'static SlingRow> {
        self.rows.iter().find(|r| r.number == number)
    }
}

#[cfg(test)]
#[expect(clippy::unwrap_used, reason = "a test may fail by panicking")]
mod tests {
    use super::*;

    #[test]
    fn overall_is_the_mean_of_three_levels() {
        // As many episodes of each level, so their mean; each figure is rounded to a digit, some are cut off.
        for row in SLING_1.rows.iter().chain(SLING_2.rows).chain(FIELD.rows) {
            let [overall, easy, medium, hard] = row.cells;
            let off = [overall.0 - (easy.0 + medium.0 + hard.0) / 3.0, overall.1 - (easy.1 + medium.1 + hard.1) / 3.0];
            assert!(off.iter().all(|d| d.abs() < 0.15), "{}: {off:?}", row.method);
        }
        for row in MODULAR.rows {
            let [easy, medium, hard, overall] = row.cells;
            let off = [overall.0 - (easy.0 + medium.0 + hard.0) / 3.0, overall.1 - (easy.1 + medium.1 + hard.1) / 3.0];
            assert!(off.iter().all(|d| d.abs() < 0.0101), "{}: {off:?}", row.model);
        }
    }

    #[test]
    fn figures_agree_with_what_the_papers_say_of_them() {
        let one = |n| SLING_1.numbered(n).unwrap().cells[0];
        let two = |n: u8| SLING_2.numbered(n).unwrap().cells[0];
        // "a 54.8% overall success and 37.3 SPL", "by 21.8% vs. ZER and 9.2% vs. OVRL".
        assert_eq!(one(11), (54.8, 37.3));
        assert!((one(11).0 - one(5).0 - 21.8).abs() < 1e-9 && (one(11).0 - one(6).0 - 9.2).abs() < 1e-9);
        // "improves the success rate of DDPPO by 22.2%, NRNS by 21.8%".
        assert!((one(9).0 - one(3).0 - 22.2).abs() < 1e-9 && (one(10).0 - one(4).0 - 21.8).abs() < 1e-9);
        // "a drop of 12% (rows 2 & 4)", "from 43.5 to 53.7%", "67.7 -> 86.2%", SPL "15.1 -> 14.3 -> 14.0".
        assert!((two(2).0 - two(4).0 - 12.0).abs() < 1e-9);
        assert_eq!((two(2).0, two(10).0, two(11).0, two(12).0), (43.5, 53.7, 67.7, 86.2));
        assert_eq!((two(2).1, two(6).1, two(7).1), (15.1, 14.3, 14.0));
        // Both tables print SLING + NRNS-GD and NRNS.
        assert_eq!(SLING_1.numbered(10).unwrap().cells, SLING_2.numbered(2).unwrap().cells);
        assert_eq!(SLING_1.numbered(4).unwrap().cells, SLING_2.numbered(1).unwrap().cells);
        // "6% improvement in average SR, and 8% improvement in average SPL over Ours-RP".
        let model = |name| MODULAR.rows.iter().find(|r| r.model == name).unwrap().cells[3];
        let (ours, random) = (model("Ours_1"), model("Ours-RP"));
        assert!((ours.0 - random.0 - 0.06).abs() < 1e-9 && (ours.1 - random.1 - 0.08).abs() < 1e-9);
    }

    #[test]
    fn rows_are_numbered_as_printed() {
        for table in [SLING_1, SLING_2] {
            for (i, row) in table.rows.iter().enumerate() {
                assert_eq!(usize::from(row.number), i + 1, "{}", row.method);
            }
        }
    }
}
