//! Pairs of recorded frames, for the benchmark of perception.

use std::collections::BTreeMap;

use homing_benchmark::RunError;
use homing_benchmark::perception::{PairFacts, PairKind, PairSource, PlannedPair, PosedFrame, Unit};
use homing_core::Transform;
use homing_robot::Recording;
use homing_sim::views::{View, overlap};
use nalgebra::Vector3;

/// Pairs of one unit.
const PAIRS: usize = 12;

/// Pairs of a recording's frames, so many frames apart.
pub struct RecordedPairs {
    recording: Recording,
    /// Query, goal, frames between them.
    pairs: Vec<(u32, u32, u32)>,
}

impl RecordedPairs {
    /// Every `stride`-th frame as start, its goal each of `gaps` frames later; by start within a gap.
    pub fn new(recording: Recording, gaps: &[u32], stride: u32) -> Self {
        let of_gap = |&gap: &u32| recording.pairs(gap, stride).into_iter().map(move |(query, goal)| (query, goal, gap));
        let pairs = gaps.iter().flat_map(of_gap).collect();
        Self { recording, pairs }
    }

    /// How many there are.
    pub fn len(&self) -> usize {
        self.pairs.len()
    }

    fn frame(&self, number: u32) -> Result<PosedFrame, RunError> {
        let failed = |cause| RunError::Recording(Box::new(cause));
        let frame = self.recording.frame(number).map_err(failed)?;
        let t_world_camera = self.recording.t_world_camera(number).map_err(failed)?;
        Ok(PosedFrame { frame, t_world_camera: Transform::new(*t_world_camera.isometry()) })
    }
}

impl PairSource for RecordedPairs {
    fn n_units(&self) -> usize {
        self.pairs.len().div_ceil(PAIRS)
    }

    fn unit(&self, i: usize) -> Result<Unit, RunError> {
        let chosen = &self.pairs[i * PAIRS..(PAIRS * (i + 1)).min(self.pairs.len())];
        let mut numbers: Vec<u32> = chosen.iter().flat_map(|&(query, goal, _)| [query, goal]).collect();
        numbers.sort_unstable();
        numbers.dedup();
        let frames = numbers.iter().map(|&n| self.frame(n)).collect::<Result<Vec<_>, _>>()?;
        let at: BTreeMap<u32, usize> = numbers.into_iter().zip(0..).collect();
        let pairs = chosen.iter().map(|&(query, goal, gap)| {
            let (a, b) = (at[&query], at[&goal]);
            PlannedPair { query: a, goal: b, facts: facts((query, goal, gap), (&frames[a], &frames[b])) }
        });
        let pairs = pairs.collect();
        Ok(Unit { frames, pairs })
    }
}

fn facts((query, goal, gap): (u32, u32, u32), (a, b): (&PosedFrame, &PosedFrame)) -> PairFacts {
    let axis = |f: &PosedFrame| f.t_world_camera.rotation() * Vector3::z();
    PairFacts {
        kind: PairKind::Seen,
        // One camera, one way through one room: nothing groups its pairs.
        cluster: u64::from(query),
        query,
        goal,
        overlap: overlap(&view(a), &view(b)),
        turn_deg: Some(axis(a).angle(&axis(b)).to_degrees()),
        distance_m: Some((a.t_world_camera.translation() - b.t_world_camera.translation()).norm()),
        same_state: true,
        frames_apart: Some(gap),
    }
}

/// As the simulator's view, to ask it what two share.
fn view(posed: &PosedFrame) -> View {
    View {
        camera: posed.frame.intrinsics,
        t_world_camera: Transform::new(*posed.t_world_camera.isometry()),
        rgb: homing_core::RgbImage::clone(&posed.frame.rgb),
        depth: homing_core::DepthImage::clone(&posed.frame.depth),
        variant: 0,
    }
}
