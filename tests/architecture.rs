//! The direction of dependencies, and the shape of the tree: what ARCHITECTURE.md draws, checked.
#![expect(clippy::unwrap_used, clippy::panic, reason = "a test may fail by panicking")]

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::Path;

use cargo_metadata::{DependencyKind, Metadata, MetadataCommand, Package, PackageId};
use homing_tests::repository;

/// Who may depend on whom. The same lines stand in ARCHITECTURE.md, in a fenced block marked `dependencies`.
const ALLOWED: &str = "
homing-core            ->
homing-perception      -> core
homing-planner         -> core
homing-safety          -> core
homing-robot           -> core
homing-monitor         -> core
homing-sim             -> core
homing-protocol        -> core
homing-privileged      -> core protocol
homing-perception-node -> core perception protocol
homing-planner-node    -> core planner protocol
homing-robot-node      -> core robot protocol
homing-monitor-node    -> core monitor protocol privileged
homing-sim-node        -> core sim safety protocol privileged
homing-benchmark       -> core monitor perception planner sim
homing-benchmark-planner -> core planner planner-node protocol sim
homing                 -> core perception planner robot sim protocol privileged benchmark
homing-tests           -> core perception planner safety robot sim protocol privileged benchmark
";

/// Libraries of others that only one of our crates may name.
const SOLE_OWNERS: [(&str, &str); 5] = [
    ("zenoh", "homing-protocol"),
    ("hiroz", "homing-protocol"),
    ("opencv", "homing-perception"),
    ("ort", "homing-perception"),
    ("rerun", "homing-monitor"),
];

/// What a crate must not reach, however many steps away.
const UNREACHABLE: [(&str, &[&str]); 5] = [
    ("homing-perception-node", &["homing-privileged", "homing-sim"]),
    ("homing-planner-node", &["homing-privileged", "homing-sim", "opencv", "ort"]),
    ("homing-planner", &["opencv", "opencv-binding-generator", "ort", "ort-sys", "zenoh", "hiroz", "tokio"]),
    ("homing-perception", &["zenoh", "hiroz", "tokio"]),
    ("homing-safety", &["opencv", "ort", "zenoh", "hiroz", "tokio"]),
];

/// Everything at the top of the tree that does not begin with a dot.
const TOP_LEVEL: [&str; 10] = [
    "ARCHITECTURE.md",
    "Cargo.lock",
    "Cargo.toml",
    "LICENSE",
    "README.md",
    "deploy",
    "nodes",
    "protocol",
    "sim_bridge",
    "tests",
];

#[test]
fn dependencies_point_the_allowed_way() {
    let metadata = metadata();
    let allowed = edges(ALLOWED);
    for package in metadata.workspace_packages() {
        let name = package.name.as_str();
        let allowed = allowed.get(name).unwrap_or_else(|| panic!("{name} is not in the table: say what it may use"));
        for dependency in ours(package) {
            assert!(
                allowed.contains(&dependency),
                "{name} depends on {dependency}, which the architecture does not allow; it may use {allowed:?}"
            );
        }
    }
    let members: BTreeSet<&str> = metadata.workspace_packages().iter().map(|p| p.name.as_str()).collect();
    for (name, targets) in &allowed {
        for listed in targets.iter().chain([name]) {
            assert!(members.contains(listed.as_str()), "the table names {listed}, which does not exist");
        }
    }
}

#[test]
fn the_page_shows_the_same_table() {
    let page = page();
    let block = fenced(&page, "dependencies").unwrap_or_else(|| panic!("ARCHITECTURE.md has no block ```dependencies"));
    assert_eq!(edges(&block), edges(ALLOWED), "ARCHITECTURE.md and the tested table differ");
}

#[test]
fn what_the_page_names_is_there() {
    let page = page();
    // Between backquotes, what begins with a folder of the top level is a path.
    let paths = page
        .split('`')
        .skip(1)
        .step_by(2)
        .flat_map(str::split_whitespace)
        .filter(|path| path.split_once('/').is_some_and(|(top, _)| TOP_LEVEL.contains(&top) || top == ".cargo"));
    let mut n_paths = 0;
    for path in paths {
        n_paths += 1;
        assert!(repository().join(path).exists(), "ARCHITECTURE.md names {path}, which does not exist");
    }
    assert!(n_paths > 10, "only {n_paths} paths were found");
}

#[test]
fn only_one_crate_names_each_foreign_library() {
    for package in metadata().workspace_packages() {
        for dependency in &package.dependencies {
            for (library, owner) in SOLE_OWNERS {
                let names_it = dependency.name == library || dependency.name.starts_with(&format!("{library}-"));
                assert!(
                    !names_it || package.name.as_str() == owner,
                    "{} names {}: only {owner} may",
                    package.name,
                    dependency.name
                );
            }
        }
    }
}

#[test]
fn what_must_stay_apart_is_apart_over_all_steps() {
    let metadata = metadata();
    for (from, forbidden) in UNREACHABLE {
        let reached = reachable(&metadata, from);
        assert!(reached.contains("homing-core"), "{from} reaches nothing: the graph was misread");
        for name in forbidden {
            assert!(!reached.contains(*name), "{from} reaches {name}");
        }
    }
    let sim = reachable(&metadata, "homing-sim-node");
    assert!(sim.contains("zenoh") && sim.contains("homing-privileged"), "the graph was misread");
}

#[test]
fn the_core_uses_two_libraries() {
    let metadata = metadata();
    let core = metadata.workspace_packages().into_iter().find(|p| p.name.as_str() == "homing-core").unwrap();
    let names: BTreeSet<&str> = core.dependencies.iter().map(|d| d.name.as_str()).collect();
    assert_eq!(names, BTreeSet::from(["nalgebra", "thiserror"]));
}

#[test]
fn every_member_is_held_to_the_workspace_lints() {
    for package in metadata().workspace_packages() {
        let manifest: toml::Table = fs::read_to_string(&package.manifest_path).unwrap().parse().unwrap();
        let inherits = manifest.get("lints").and_then(|l| l.get("workspace")).and_then(toml::Value::as_bool);
        assert_eq!(inherits, Some(true), "{} lacks [lints] workspace = true", package.name);
    }
}

#[test]
fn the_top_of_the_tree_holds_this_and_nothing_else() {
    let allowed = BTreeSet::from(TOP_LEVEL);
    for name in &allowed {
        assert!(repository().join(name).exists(), "{name} is missing");
    }
    for entry in fs::read_dir(repository()).unwrap() {
        let name = entry.unwrap().file_name().into_string().unwrap();
        // What a build and a demo leave behind is ignored by git.
        let ignored = name.starts_with('.') || name == "target" || name == "runs" || name.ends_with(".rrd");
        assert!(ignored || allowed.contains(name.as_str()), "{name} does not belong at the top of the tree");
    }
}

#[test]
fn files_stay_short_enough_to_read() {
    const LINES_MAX: usize = 450;
    let mut n_files = 0;
    for folder in ["protocol", "nodes", "sim_bridge", "tests"] {
        for_each_source(&repository().join(folder), &mut |file, text| {
            n_files += 1;
            let lines = text.lines().count();
            assert!(lines <= LINES_MAX, "{} has {lines} lines; {LINES_MAX} are allowed", file.display());
        });
    }
    assert!(n_files > 100, "only {n_files} source files were found");
}

fn metadata() -> Metadata {
    MetadataCommand::new()
        .current_dir(repository())
        // Crates of other platforms were never fetched.
        .other_options(["--offline".to_owned(), "--filter-platform".to_owned(), host()])
        .exec()
        .unwrap()
}

fn host() -> String {
    let version = std::process::Command::new("rustc").arg("-vV").output().unwrap();
    let text = String::from_utf8(version.stdout).unwrap();
    text.lines().find_map(|l| l.strip_prefix("host: ")).unwrap().to_owned()
}

/// `name -> a b c` lines, the common prefix left out on the right.
fn edges(table: &str) -> BTreeMap<String, BTreeSet<String>> {
    let lines = table.lines().filter(|l| !l.trim().is_empty());
    lines
        .map(|line| {
            let (from, to) = line.split_once("->").unwrap_or_else(|| panic!("not an edge: {line}"));
            let targets = to.split_whitespace().map(|t| format!("homing-{t}")).collect();
            (from.trim().to_owned(), targets)
        })
        .collect()
}

fn ours(package: &Package) -> BTreeSet<String> {
    package.dependencies.iter().filter(|d| d.path.is_some()).map(|d| d.name.clone()).collect()
}

/// Names of everything a crate is built from, itself included. What only its tests use does not count.
fn reachable(metadata: &Metadata, from: &str) -> BTreeSet<String> {
    let resolve = metadata.resolve.as_ref().unwrap();
    let nodes: BTreeMap<&PackageId, _> = resolve.nodes.iter().map(|n| (&n.id, n)).collect();
    let start = &metadata.workspace_packages().into_iter().find(|p| p.name.as_str() == from).unwrap().id;
    let (mut seen, mut waiting) = (BTreeSet::from([start]), vec![start]);
    while let Some(id) = waiting.pop() {
        for dependency in &nodes[id].deps {
            let built = dependency.dep_kinds.iter().any(|k| k.kind != DependencyKind::Development);
            if built && seen.insert(&dependency.pkg) {
                waiting.push(&dependency.pkg);
            }
        }
    }
    seen.into_iter().map(|id| metadata[id].name.to_string()).collect()
}

fn page() -> String {
    fs::read_to_string(repository().join("ARCHITECTURE.md")).unwrap()
}

fn fenced(page: &str, mark: &str) -> Option<String> {
    let from = page.split_once(&format!("```{mark}\n"))?.1;
    Some(from.split_once("```")?.0.to_owned())
}

fn for_each_source(folder: &Path, visit: &mut impl FnMut(&Path, &str)) {
    for entry in fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        if path.is_dir() {
            for_each_source(&path, visit);
        } else if path.extension().is_some_and(|e| e == "rs") {
            visit(&path, &fs::read_to_string(&path).unwrap());
        }
    }
}
