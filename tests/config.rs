//! The configurations in deploy/ are taken by the processes they are for, and show the defaults the code has.
#![expect(clippy::unwrap_used, clippy::panic, reason = "a test may fail by panicking")]

use std::collections::BTreeSet;
use std::fs;
use std::net::TcpListener;
use std::path::{Path, PathBuf};

use homing_tests::processes::System;
use homing_tests::repository;

/// Files by their names, and the processes they are for.
const BINARIES: [(&str, &str); 5] = [
    ("sim", "homing-sim"),
    ("recording", "homing-robot"),
    ("perception", "homing-perception"),
    ("planner", "homing-planner"),
    ("monitor", "homing-monitor"),
];

fn files() -> Vec<PathBuf> {
    let mut found = Vec::new();
    for folder in fs::read_dir(repository().join("deploy")).unwrap() {
        let folder = folder.unwrap().path();
        if folder.is_dir() {
            let entries = fs::read_dir(folder).unwrap().map(|f| f.unwrap().path());
            found.extend(entries.filter(|f| f.extension().is_some_and(|e| e == "toml")));
        }
    }
    found.sort();
    found
}

fn binary(file: &Path) -> &'static str {
    let stem = file.file_stem().unwrap().to_str().unwrap();
    let found = BINARIES.iter().find(|(name, _)| *name == stem);
    found.unwrap_or_else(|| panic!("which process is {} for?", file.display())).1
}

/// Starts a process on a configuration moved to the system's port, where it cannot stay: a body finds the port taken,
/// the others nobody there. Gives what it said.
fn tried(system: &System, binary: &str, mut config: toml::Table) -> String {
    let session = config.entry("session").or_insert_with(|| toml::Table::new().into()).as_table_mut().unwrap();
    let is_body = ["homing-sim", "homing-robot"].contains(&binary);
    session.insert(if is_body { "listen" } else { "connect" }.to_owned(), vec![system.endpoint()].into());
    session.insert("connect_timeout_s".to_owned(), 1.into());
    // Nothing opens and nothing stays behind.
    for (key, value) in [("viewer", "/bin/true".to_owned()), ("recording", format!("{}.rrd", system.endpoint()))] {
        if binary == "homing-monitor" && config.contains_key(key) {
            let value = if key == "recording" { system.file("monitor.rrd", "").display().to_string() } else { value };
            config.insert(key.to_owned(), value.into());
        }
    }
    let _taken = is_body.then(|| TcpListener::bind(("127.0.0.1", system.port())).unwrap());
    let mut process = system.start(binary, &config.to_string());
    let status = process.ends();
    let said = process.said();
    assert_eq!(status.code(), Some(1), "{said}");
    assert!(said.contains(if is_body { "cannot listen on" } else { "no robot answers" }), "{said}");
    said
}

fn table(file: &Path) -> toml::Table {
    fs::read_to_string(file).unwrap().parse().unwrap()
}

#[test]
fn every_file_is_taken_by_its_process() {
    let system = System::new();
    let files = files();
    for (_, binary_name) in BINARIES {
        assert!(files.iter().any(|f| binary(f) == binary_name), "no file is for {binary_name}");
    }
    for file in files {
        tried(&system, binary(&file), table(&file));
    }
}

#[test]
fn every_file_says_where_it_meets_the_others() {
    for file in files() {
        let config = table(&file);
        let is_body = ["homing-sim", "homing-robot"].contains(&binary(&file));
        let key = if is_body { "listen" } else { "connect" };
        let endpoints = config.get("session").and_then(|s| s.get(key)).and_then(toml::Value::as_array);
        let endpoints = endpoints.unwrap_or_else(|| panic!("{} has no session.{key}", file.display()));
        for endpoint in endpoints {
            let endpoint = endpoint.as_str().unwrap();
            assert!(endpoint.starts_with("tcp/") && endpoint.ends_with(":7447"), "{}: {endpoint}", file.display());
        }
    }
}

/// The configuration a process says it has.
fn effective(said: &str) -> &str {
    let line = said.lines().find(|l| l.contains("effective configuration")).unwrap();
    line.split_once("config=").unwrap().1
}

/// With numbers to nine places: 15 degrees are not exactly what the code's radians are in degrees.
fn rounded(debug: &str) -> String {
    let (mut text, mut number) = (String::new(), String::new());
    for c in debug.chars().chain(['\n']) {
        if c.is_ascii_digit() || (c == '.' && !number.is_empty()) {
            number.push(c);
            continue;
        }
        match number.parse::<f64>() {
            Ok(value) => text += &format!("{value:.9}"),
            Err(_) => text += &number,
        }
        number.clear();
        text.push(c);
    }
    text
}

/// Names of fields in a value's debug form.
fn fields(debug: &str) -> BTreeSet<&str> {
    let words = debug.split_whitespace().filter_map(|word| word.strip_suffix(':'));
    words.filter(|w| w.chars().all(|c| c.is_ascii_lowercase() || c == '_')).collect()
}

#[test]
fn the_files_for_one_machine_show_all_keys_and_the_defaults() {
    let system = System::new();
    for (stem, binary) in BINARIES.into_iter().filter(|(stem, _)| *stem != "recording") {
        let file = repository().join(format!("deploy/all_in_one/{stem}.toml"));
        let shown = tried(&system, binary, table(&file));
        let default = tried(&system, binary, toml::Table::new());
        assert_eq!(rounded(effective(&shown)), rounded(effective(&default)), "{}", file.display());
        let text = fs::read_to_string(&file).unwrap();
        let keys = fields(effective(&default));
        assert!(keys.len() > 6, "the keys were misread: {keys:?}");
        for key in keys {
            // Whoever listens does not connect.
            let other = if stem == "sim" { "connect" } else { "listen" };
            assert!(key == other || text.contains(key), "{} does not show {key}", file.display());
        }
    }
}
