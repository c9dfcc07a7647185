//! Reports of hand-made records, against figures worked out by hand.
#![expect(clippy::unwrap_used, reason = "a test may fail by panicking")]

use homing_sim::episode::{Level, Shape};
use homing_sim::score::{Finish, Score};

use super::ablations::{Agreement, Direction};
use super::{BASE, CURVED, LAYOUTS, Report, RunInfo, clip_path};
use crate::episode::StageSeconds;
use crate::record::{CellKey, EpisodeRecord};
use crate::{Cause, Watch};

/// An episode of 4 m that took 10 steps and 2 s, with an SPL of `spl` if it was won.
fn record(row: &str, set: &str, id: &str, spl: Option<f64>) -> EpisodeRecord {
    let finish = Finish {
        success_m: 1.0,
        stopped: spl.is_some(),
        steps: 10,
        last_mile_steps: 2,
        path_length_m: 4.0 / spl.unwrap_or(0.5),
        shortest_path_m: 4.0,
        final_distance_m: Some(if spl.is_some() { 0.2 } else { 3.0 }),
        final_straight_m: if spl.is_some() { 0.2 } else { 3.0 },
        final_heading_error_rad: 0.0,
        collisions: 1,
    };
    EpisodeRecord {
        cell: CellKey { row: row.to_owned(), set: set.to_owned() },
        scene: "flat".to_owned(),
        episode_id: id.to_owned(),
        level: Level::Medium,
        shape: Shape::Curved,
        strict: Score::strict(&finish),
        published: Score::published(&finish),
        cause: spl.is_none().then_some(Cause::Stuck),
        reason: "because".to_owned(),
        watch: Watch::default(),
        first_heading_rad: None,
        times: StageSeconds { observe: 0.5, extract: 0.5, matching: 0.25, pose: 0.25, plan: 0.25 },
        wall_s: 2.0,
        commit: "abc".to_owned(),
    }
}

fn at(level: Level, record: EpisodeRecord) -> EpisodeRecord {
    EpisodeRecord { level, ..record }
}

fn three_levels() -> Vec<EpisodeRecord> {
    // By the published rule the lost one is won: it ended 0.9 m away in a straight line, without a stop.
    let mut near = at(Level::Easy, record(BASE, CURVED, "b", None));
    near.published.success = true;
    near.published.spl = 0.5;
    vec![
        at(Level::Easy, record(BASE, CURVED, "a", Some(0.8))),
        near,
        at(Level::Hard, record(BASE, CURVED, "c", Some(0.5))),
        at(Level::Extra, record(BASE, CURVED, "d", Some(1.0))),
    ]
}

fn report(records: &[EpisodeRecord]) -> Report {
    Report::new(&RunInfo::default(), records)
}

/// The cells of the nth row of a Markdown text that begins with a name.
fn cells(markdown: &str, name: &str, nth: usize) -> Vec<String> {
    let rows = markdown.lines().map(|l| l.split('|').map(|c| c.trim().to_owned()).collect::<Vec<_>>());
    let row = rows.filter(|cells| cells.get(1).is_some_and(|c| c == name)).nth(nth).unwrap();
    row[2..].to_vec()
}

#[test]
fn cells_are_those_worked_out_by_hand() {
    let report = report(&three_levels());
    let row = report.sets[0].row(BASE).unwrap();
    let overall = row.overall.as_ref().unwrap();
    assert_eq!((overall.n, overall.success.n_hits), (3, 2), "extra is no part of overall");
    assert!((overall.spl.mean - 1.3 / 3.0).abs() < 1e-12);
    assert_eq!((overall.published_success.n_hits, row.mean_of_levels), (3, None));
    assert_eq!(row.levels[3].as_ref().unwrap().n, 1);

    let markdown = report.to_markdown();
    let ours = cells(&markdown, "Homing (frontier)", 0);
    let expected = ["66.7", "43.3", "50.0", "40.0", "-", "-", "100.0", "50.0", "100.0", "60.0"];
    assert_eq!(ours[..10], expected);
    // The next line is the interval: Wilson of 2 in 3.
    let line = markdown.lines().position(|l| l.contains("66.7") && l.contains("Homing")).unwrap();
    assert!(markdown.lines().nth(line + 1).unwrap().contains("20.8\u{2013}93.9"), "{markdown}");
}

#[test]
fn published_rows_stand_beside_ours_and_what_is_missing_says_why() {
    let markdown = report(&three_levels()).to_markdown();
    let theirs = cells(&markdown, "SLING + OVRL-GD", 0);
    assert_eq!(theirs[..8], ["54.8", "37.3", "65.4", "45.7", "59.5", "40.6", "39.6", "25.5"]);
    let ours = cells(&markdown, "SLING + OVRL-GD", 1);
    assert_eq!((ours[0].as_str(), ours[10].as_str()), ("-", "not measured: needs a learned policy"));
    let straight = cells(&markdown, "SLING + Straight-GD", 1);
    assert_eq!((straight[0].as_str(), straight[10].as_str()), ("-", "no episodes in this run"));
    assert_eq!(cells(&markdown, "NTS", 0)[..4], ["0.80 / 0.60", "0.47 / 0.31", "0.37 / 0.22", "0.55 / 0.38"]);
    assert!(markdown.contains("Not measured yet.") && markdown.contains("Ours: not measured in this run."));
}

#[test]
fn differences_are_taken_on_the_same_episodes() {
    let records = [
        record(BASE, CURVED, "a", Some(1.0)),
        record(BASE, CURVED, "b", Some(0.5)),
        record(BASE, CURVED, "c", None),
        record(BASE, CURVED, "only base", Some(1.0)),
        record("sift", CURVED, "a", None),
        record("sift", CURVED, "b", Some(0.8)),
        record("sift", CURVED, "c", None),
        record("sift", CURVED, "only sift", Some(1.0)),
        record("sift", LAYOUTS, "a", Some(1.0)),
    ];
    let report = report(&records);
    assert_eq!(report.ablations.len(), 1, "the layouts have no base row");
    let d = &report.ablations[0].differences[0];
    assert_eq!((d.row.as_str(), d.n, d.n_only_base, d.n_only_row), ("sift", 3, 1, 0));
    assert!((d.success + 1.0 / 3.0).abs() < 1e-12);
    assert!(d.success_95.0 < d.success && d.success < d.success_95.1 && d.success_95.1 > 0.0, "{d:?}");
    // Gains of SPL: -1, 0.3, 0.
    assert!((d.spl.unwrap().mean + 0.7 / 3.0).abs() < 1e-12);
    assert_eq!(d.p_mcnemar, 1.0);
    let published = d.published.unwrap();
    assert_eq!((published.number, published.direction), (5, Direction::Down));
    assert!((published.success + 9.8).abs() < 1e-9 && (published.spl + 3.8).abs() < 1e-9);
    assert_eq!(d.agreement, Agreement::WithinNoise);
}

#[test]
fn agreement_needs_an_interval_that_says_something() {
    let of = |direction, interval| Agreement::of(direction, interval);
    assert_eq!(of(Some(Direction::Down), (-0.2, -0.1)), Agreement::Agrees);
    assert_eq!(of(Some(Direction::Down), (0.1, 0.2)), Agreement::Disagrees);
    assert_eq!(of(Some(Direction::Up), (-0.1, 0.2)), Agreement::WithinNoise);
    assert_eq!(of(Some(Direction::None), (-0.02, 0.03)), Agreement::Agrees);
    assert_eq!(of(Some(Direction::None), (-0.2, 0.3)), Agreement::WithinNoise);
    assert_eq!(of(Some(Direction::None), (-0.2, -0.1)), Agreement::Disagrees);
    assert_eq!(of(None, (0.1, 0.2)), Agreement::NotReported);
    let direction = |row| super::ablations::published_difference(row).map(|p| p.direction);
    assert_eq!(direction("pose-noise"), Some(Direction::None));
    assert_eq!(direction("pose-depth-noise"), Some(Direction::None));
    assert_eq!(direction("mlp-switch"), Some(Direction::Down));
    assert_eq!(direction("oracle-gd"), Some(Direction::Up));
    assert_eq!(direction("epnp"), None);
}

#[test]
fn an_episode_counts_once_whatever_the_order() {
    let lost = record(BASE, CURVED, "a", None);
    let mut records = three_levels();
    records.push(lost.clone());
    let forwards = report(&records);
    assert_eq!((forwards.n_episodes, forwards.n_repeated), (4, 1));
    assert_eq!(forwards.sets[0].row(BASE).unwrap().overall.as_ref().unwrap().success.n_hits, 1, "not in our favour");
    records.reverse();
    assert_eq!(report(&records), forwards);
}

#[test]
fn a_page_is_well_formed_and_shows_names_as_they_are() {
    let mut records = three_levels();
    let name = "<script>&\"'|`".to_owned();
    for (i, set) in [CURVED, LAYOUTS].into_iter().enumerate() {
        let mut odd = record(BASE, set, &i.to_string(), None);
        (odd.scene, odd.reason, odd.first_heading_rad) = (name.clone(), format!("{name} again"), Some((0.1, 0.2)));
        odd.cell.row = BASE.to_owned();
        records.push(odd);
    }
    records.push(record("<odd> & row", "<odd> & set", "1", Some(1.0)));
    records.push(record("random", "<odd> & set", "1", Some(1.0)));
    let info = RunInfo { notes: vec!["a < b & c".to_owned()], link: vec![(1.0, 0.5)], ..RunInfo::default() };
    let html = Report::new(&info, &records).to_html().unwrap();
    assert_balanced(&html);
    assert!(!html.contains("<script") && !html.contains("<odd>"), "markup came through");
    assert!(html.contains("&lt;script&gt;&amp;&quot;&#39;|`") && html.contains("a &lt; b &amp; c"));
    assert!(html.contains("&lt;odd&gt; &amp; row"), "a row that no table knows is shown, too");
    assert!(html.matches("<svg").count() >= 8, "{} pictures", html.matches("<svg").count());
    assert!(!html.contains("http-equiv") && !html.contains("src=") && !html.contains("@import"), "it stands alone");
}

/// Every tag that is opened is closed, in order.
fn assert_balanced(html: &str) {
    let mut open: Vec<String> = Vec::new();
    for part in html.split('<').skip(1) {
        let tag = part.split_once('>').unwrap().0;
        let name: String = tag.trim_start_matches('/').chars().take_while(|c| c.is_ascii_alphanumeric()).collect();
        assert!(!name.is_empty() || tag.starts_with('!'), "a bare <: {part}");
        if tag.starts_with('/') {
            assert_eq!(open.pop(), Some(name), "closed in the wrong order");
        } else if !tag.ends_with('/') && !tag.starts_with('!') {
            open.push(name);
        }
    }
    assert!(open.is_empty(), "never closed: {open:?}");
}

#[test]
fn no_episodes_give_a_report_that_says_so() {
    let report = report(&[]);
    assert!(report.to_markdown().contains("no episodes: nothing was measured"));
    let html = report.to_html().unwrap();
    assert_balanced(&html);
    assert!(html.contains("no episodes: nothing was measured"));
    assert!(report.to_json().unwrap().contains("\"n_episodes\": 0"));
}

#[test]
fn what_is_no_number_reaches_no_figure() {
    let mut broken = record(BASE, CURVED, "broken", Some(1.0));
    broken.strict.spl = f64::NAN;
    broken.strict.final_distance_m = f64::INFINITY;
    (broken.wall_s, broken.times.plan) = (f64::NAN, f64::NEG_INFINITY);
    broken.first_heading_rad = Some((f64::NAN, 0.0));
    let mut lost = record(BASE, CURVED, "lost", None);
    lost.strict.final_distance_m = f64::NAN;
    let records = [broken, lost, record(BASE, CURVED, "whole", Some(0.5))];
    let info = RunInfo { link: vec![(f64::NAN, 0.5), (1.0, 0.25)], ..RunInfo::default() };
    let report = Report::new(&info, &records);
    assert_eq!(report.n_not_finite, 2);
    let json: serde_json::Value = serde_json::from_str(&report.to_json().unwrap()).unwrap();
    let overall = &json["sets"][0]["rows"][0]["overall"];
    assert!((overall["spl"]["mean"].as_f64().unwrap() - 0.5 / 3.0).abs() < 1e-12, "the broken one counts as 0");
    assert_eq!(json["info"]["link"], serde_json::json!([[1.0, 0.25]]));
    assert_eq!(json["headings"], serde_json::json!([]));
    assert_eq!(json["failures"][0]["final_distance_m"], serde_json::Value::Null);
    // 30 steps in the 4 s that are known; the two distances that are known.
    assert_eq!(json["speed"][0]["steps_per_second"], serde_json::json!(7.5));
    assert_eq!(json["speed"][0]["final_distance_m_mean"], serde_json::json!(0.2));
    assert!(!report.to_html().unwrap().contains("NaN") && !report.to_markdown().contains("inf"));
}

#[test]
fn speed_and_collisions_are_those_worked_out_by_hand() {
    let report = report(&[record(BASE, CURVED, "a", Some(0.5)), record(BASE, CURVED, "b", None)]);
    let speed = &report.speed[0];
    assert_eq!((speed.episodes_per_minute, speed.steps_per_second), (Some(30.0), Some(5.0)));
    // 0.5 s of 10 steps; 2 s less 1.75 s.
    assert!((speed.stage_ms.observe - 50.0).abs() < 1e-9 && (speed.other_ms - 25.0).abs() < 1e-9);
    assert_eq!((speed.collisions_mean, speed.collided_share), (1.0, 0.1));
    // (1 - 0.2 / 4) * 0.5 and (1 - 3 / 4) * 0.5.
    assert!((speed.soft_spl.unwrap().mean - 0.3).abs() < 1e-12);
    assert_eq!(speed.success_distance_m_median, Some(0.2));
    let bins: Vec<usize> = report.distances[0].bins.iter().map(|b| b.success.n).collect();
    assert_eq!(bins, [0, 0, 2], "4 m lie between 3 and 5");
}

#[test]
fn headings_are_compared_as_samples_and_one_by_one() {
    let with = |id: &str, believed_deg: f64, true_deg: f64| EpisodeRecord {
        first_heading_rad: Some((believed_deg.to_radians(), true_deg.to_radians())),
        ..record(BASE, CURVED, id, None)
    };
    let report = report(&[with("a", 20.0, 10.0), with("b", 10.0, 20.0), with("c", -170.0, -173.0)]);
    let h = &report.headings[0];
    assert!((h.wasserstein_deg - 1.0).abs() < 1e-9, "as samples they differ by 3 degrees in one of three");
    assert!((h.error_deg_median - 10.0).abs() < 1e-9);
    assert_eq!((h.within_15_believed.n_hits, h.within_15_true.n_hits), (1, 1));
    assert_eq!((h.bins_true[0], h.bins_true[12], h.bins_true[13]), (1, 1, 1));
}

#[test]
fn failures_lead_to_the_clips_that_exist() {
    let mut lost = record(BASE, LAYOUTS, "7/8", None);
    lost.scene = "../Avonia 0.16".to_owned();
    let path = clip_path(&lost);
    assert_eq!(path, "clips/frontier/layouts/_._Avonia_0.16-7_8.rrd");
    let other = record(BASE, LAYOUTS, "9", None);
    let info = RunInfo { clips: [path.clone()].into(), ..RunInfo::default() };
    let report = Report::new(&info, &[lost, other, record("sift", LAYOUTS, "9", None)]);
    let clips: Vec<Option<&str>> = report.failures.iter().map(|f| f.clip.as_deref()).collect();
    assert_eq!(clips, [Some(path.as_str()), None], "ablations are not listed");
    assert!(report.to_html().unwrap().contains(&format!("<a href=\"{path}\">clip</a>")));
    assert!(report.to_markdown().contains(&format!("[clip]({path})")));
    assert_eq!(report.scenes[0].scenes.len(), 2);
}
