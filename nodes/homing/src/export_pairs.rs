//! `homing export-pairs`: pairs of RGB-D views with exact geometry, for training and for measuring features.

use std::path::PathBuf;
use std::sync::atomic::{AtomicUsize, Ordering};

use anyhow::bail;
use clap::Args;
use homing_sim::views::ViewSpec;
use homing_sim::views::export::{Export, FlatReport};
use indicatif::{ProgressBar, ProgressStyle};

use crate::Ended;
use crate::bench::seeds;

/// Takes pictures in the flat of each seed, and writes them with depth, pose and what they share.
///
/// Run again with the same folder, it goes on where it stopped. The same seeds give the same files on every machine.
#[derive(Args)]
pub struct ExportPairsArgs {
    /// Where to: a folder that is new, empty, or holds an export of the same kind.
    #[arg(value_name = "OUT")]
    out: PathBuf,
    /// Seeds of the flats, as A..B: from A to B without B.
    #[arg(long, value_parser = seeds)]
    seeds: std::ops::Range<u64>,
    /// Views of each flat.
    #[arg(long, default_value_t = 16, value_parser = clap::value_parser!(u16).range(2..=999))]
    views: u16,
    /// Columns and rows of the pictures.
    #[arg(long, value_name = "WxH", default_value = "320x240", value_parser = size)]
    size: (u32, u32),
    /// Flats side by side; 0 for one per core.
    #[arg(long, default_value_t = 0)]
    threads: usize,
}

fn size(text: &str) -> Result<(u32, u32), String> {
    let parse = || {
        let (width, height) = text.split_once('x')?;
        Some((width.parse().ok()?, height.parse().ok()?))
    };
    match parse() {
        Some((width, height)) if (32..=4096).contains(&width) && (32..=4096).contains(&height) => Ok((width, height)),
        _ => Err(format!("{text:?} is not a size such as 320x240, with sides of 32 to 4096 pixels")),
    }
}

pub fn run(args: ExportPairsArgs) -> anyhow::Result<Ended> {
    let flats = args.seeds.end - args.seeds.start;
    if flats > 1_000_000 {
        bail!("{flats} flats are more than 1000000");
    }
    let threads = match args.threads {
        0 => std::thread::available_parallelism().map_or(1, usize::from),
        n => n,
    };
    let spec = ViewSpec { n_views: usize::from(args.views), width: args.size.0, height: args.size.1 };
    let export = Export::open(&args.out, args.seeds, spec)?;
    let pending = export.pending().len() as u64;
    let bar = ProgressBar::new(flats).with_style(style()).with_position(flats - pending);
    bar.reset_eta();
    let pairs = AtomicUsize::new(0);
    export.run(threads, &|flat: &FlatReport| {
        let n = pairs.fetch_add(flat.n_pairs, Ordering::Relaxed) + flat.n_pairs;
        bar.inc(1);
        bar.set_message(format!("{n} pairs"));
    })?;
    bar.finish_and_clear();
    println!("{} holds {} flats of up to {} views", args.out.display(), flats, spec.n_views);
    Ok(Ended::Well)
}

fn style() -> ProgressStyle {
    ProgressStyle::with_template("{bar:30} {pos}/{len} flats  [{elapsed}, about {eta} left]  {wide_msg}")
        .unwrap_or_else(|_| ProgressStyle::default_bar())
}
