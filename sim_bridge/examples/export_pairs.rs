//! Writes pairs of RGB-D views of generated flats without the rest of the workspace: `export_pairs OUT A..B [VIEWS
//! [WIDTHxHEIGHT [THREADS]]]`. The same as `homing export-pairs`.

#![expect(clippy::unwrap_used, reason = "a tool may fail by panicking at wrong usage")]

use std::path::Path;
use std::process::ExitCode;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::time::Instant;

use homing_sim::views::ViewSpec;
use homing_sim::views::export::{Export, ExportError, FlatReport};

fn main() -> ExitCode {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let [out, seeds, options @ ..] = arguments.as_slice() else {
        eprintln!("export_pairs OUT A..B [VIEWS [WIDTHxHEIGHT [THREADS]]]");
        return ExitCode::from(2);
    };
    let (from, to) = seeds.split_once("..").unwrap();
    let n_views = options.first().map_or(16, |n| n.parse().unwrap());
    let (width, height) = options.get(1).map_or("320x240", String::as_str).split_once('x').unwrap();
    let spec = ViewSpec { n_views, width: width.parse().unwrap(), height: height.parse().unwrap() };
    let threads = options.get(2).map_or(1, |n| n.parse().unwrap());
    match export(Path::new(out), from.parse().unwrap()..to.parse().unwrap(), spec, threads) {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("export_pairs: {error}");
            ExitCode::FAILURE
        }
    }
}

fn export(out: &Path, seeds: std::ops::Range<u64>, spec: ViewSpec, threads: usize) -> Result<(), ExportError> {
    let export = Export::open(out, seeds, spec)?;
    let pending = export.pending().len();
    let (begin, done, views) = (Instant::now(), AtomicUsize::new(0), AtomicUsize::new(0));
    export.run(threads, &|flat: &FlatReport| {
        let done = done.fetch_add(1, Ordering::Relaxed) + 1;
        let views = views.fetch_add(flat.n_views, Ordering::Relaxed) + flat.n_views;
        let seconds = begin.elapsed().as_secs_f64();
        println!(
            "flat {}: {} views, {} pairs, {} KiB; {done} of {pending}, {:.1} views/s, about {:.0} s left",
            flat.seed,
            flat.n_views,
            flat.n_pairs,
            flat.bytes >> 10,
            views as f64 / seconds,
            seconds / done as f64 * (pending - done) as f64
        );
    })
}
