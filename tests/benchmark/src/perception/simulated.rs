//! Pairs of views of generated flats.

use core::ops::Range;
use std::sync::Arc;

use homing_core::{RgbdFrame, Stamp, Transform, wrap_angle};
use homing_sim::views::{Cameras, FlatViews, OVERLAP_MIN, View, ViewSpec, draw_with, overlap};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

use super::pairs::{PairFacts, PairKind, PairSource, PlannedPair, PosedFrame, Unit};
use crate::RunError;

/// Pairs are drawn so often before a flat is taken to offer no more.
const TRIES_PER_PAIR: usize = 20;

/// Views of flats by seed, two flats a unit.
///
/// Of each flat: every two views that share at least [`OVERLAP_MIN`], in both directions. And as many pairs without the goal
/// in view as pairs with it: half of them two views of the flat that share less, half a view of it and one of the other
/// flat, both drawn by the seeds.
#[derive(Clone, Debug)]
pub struct SimulatedPairs {
    /// Seeds of the flats.
    pub seeds: Range<u64>,
    /// Views of each, and their size.
    pub spec: ViewSpec,
    /// What takes them.
    pub cameras: Cameras,
}

impl PairSource for SimulatedPairs {
    fn n_units(&self) -> usize {
        (self.seeds.end - self.seeds.start).div_ceil(2) as usize
    }

    fn unit(&self, i: usize) -> Result<Unit, RunError> {
        let first = self.seeds.start + 2 * i as u64;
        let flats = (first..(first + 2).min(self.seeds.end))
            .map(|seed| draw_with(seed, &self.spec, &self.cameras))
            .collect::<Result<Vec<_>, _>>()?;
        let mut rng = ChaCha8Rng::seed_from_u64(first ^ 0x756e_7365_656e);
        let mut pairs = Vec::new();
        for (a, flat) in flats.iter().enumerate() {
            let listed = listed_pairs(flat, index(&flats, a));
            let in_view = |p: &&PlannedPair| p.facts.goal_in_view() == Some(true);
            let n_in_view = listed.iter().filter(in_view).count();
            pairs.extend(listed);
            let unseen = unseen_pairs(flat, index(&flats, a), n_in_view.div_ceil(2), &mut rng);
            // A small flat may not have enough views that share nothing: the other flat makes up for it.
            let n_elsewhere = n_in_view - unseen.len();
            pairs.extend(unseen);
            if let Some(other) = flats.get(1 - a) {
                let offsets = (index(&flats, a), index(&flats, 1 - a));
                pairs.extend(elsewhere_pairs((flat, other), offsets, n_elsewhere, &mut rng));
            }
        }
        let frames = flats.into_iter().flat_map(|f| f.views).enumerate().map(|(i, view)| posed(i, view));
        Ok(Unit { frames: frames.collect::<Result<_, _>>()?, pairs })
    }
}

/// Index of a flat's first view among the views of all flats.
fn index(flats: &[FlatViews], flat: usize) -> usize {
    flats[..flat].iter().map(|f| f.views.len()).sum()
}

/// Every pair of the flat's list, both ways.
fn listed_pairs(flat: &FlatViews, offset: usize) -> Vec<PlannedPair> {
    let both = flat.pairs.iter().flat_map(|p| [(PairKind::Seen, p.a, p.b, p), (PairKind::Turned, p.b, p.a, p)]);
    both.map(|(kind, query, goal, listed)| planned(flat, kind, (query, goal), listed.overlap, offset)).collect()
}

/// `n` pairs of views that share less than the flat's list asks for, each at most once.
fn unseen_pairs(flat: &FlatViews, offset: usize, n: usize, rng: &mut ChaCha8Rng) -> Vec<PlannedPair> {
    let n_views = flat.views.len() as u64;
    let mut pairs: Vec<PlannedPair> = Vec::with_capacity(n);
    for _ in 0..TRIES_PER_PAIR * n {
        if pairs.len() == n {
            break;
        }
        let (query, goal) = (rng.random_range(0..n_views) as usize, rng.random_range(0..n_views) as usize);
        let listed = flat.pairs.iter().any(|p| (p.a, p.b) == (query.min(goal), query.max(goal)));
        let taken = pairs.iter().any(|p| (p.query, p.goal) == (query + offset, goal + offset));
        if query != goal && !listed && !taken {
            let shared = overlap(&flat.views[query], &flat.views[goal]);
            debug_assert!(shared < OVERLAP_MIN, "what shares more is listed");
            pairs.push(planned(flat, PairKind::Unseen, (query, goal), shared, offset));
        }
    }
    pairs
}

/// `n` pairs of a view of one flat and a photo of another.
fn elsewhere_pairs(
    (flat, other): (&FlatViews, &FlatViews),
    (offset, other_offset): (usize, usize),
    n: usize,
    rng: &mut ChaCha8Rng,
) -> Vec<PlannedPair> {
    if flat.views.is_empty() || other.views.is_empty() {
        return Vec::new();
    }
    let mut pair = || {
        let query = rng.random_range(0..flat.views.len() as u64) as usize;
        let goal = rng.random_range(0..other.views.len() as u64) as usize;
        let facts = PairFacts {
            kind: PairKind::Elsewhere,
            cluster: flat.seed,
            query: query as u32,
            goal: goal as u32,
            overlap: 0.0,
            turn_deg: None,
            distance_m: None,
            same_state: false,
            frames_apart: None,
        };
        PlannedPair { query: query + offset, goal: goal + other_offset, facts }
    };
    (0..n).map(|_| pair()).collect()
}

fn planned(
    flat: &FlatViews,
    kind: PairKind,
    (query, goal): (usize, usize),
    overlap: f64,
    offset: usize,
) -> PlannedPair {
    let (a, b) = (&flat.views[query], &flat.views[goal]);
    let facts = PairFacts {
        kind,
        cluster: flat.seed,
        query: query as u32,
        goal: goal as u32,
        overlap,
        turn_deg: Some(wrap_angle(a.yaw_rad() - b.yaw_rad()).abs().to_degrees()),
        distance_m: Some((a.t_world_camera.translation() - b.t_world_camera.translation()).norm()),
        same_state: a.variant == b.variant,
        frames_apart: None,
    };
    PlannedPair { query: query + offset, goal: goal + offset, facts }
}

fn posed(i: usize, view: View) -> Result<PosedFrame, RunError> {
    let frame = RgbdFrame::new(Stamp(i as u64), Arc::new(view.rgb), Arc::new(view.depth), view.camera)?;
    Ok(PosedFrame { frame, t_world_camera: Transform::new(*view.t_world_camera.isometry()) })
}
