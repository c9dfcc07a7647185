//! Random goal: every so often a place drawn from the map so far ("Ours-RP" of modular image-goal navigation, IV.A).

use homing_core::{Action, Directive, DiscoveryView, GoalDiscovery};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

/// Decisions between two draws (the paper's long-term goals are k = 10 steps apart).
const DECISIONS: u32 = 10;
/// A place nearer than this is reached, metres.
const REACHED_M: f64 = 0.3;

/// Drives to places drawn at random, uniformly over what the map knows to be reachable.
#[derive(Clone, Debug)]
pub struct RandomGoal {
    seed: u64,
    rng: ChaCha8Rng,
    target: Option<(f64, f64)>,
    decisions_left: u32,
}

impl RandomGoal {
    /// A new episode's policy; equal seeds draw equal places.
    #[must_use]
    pub fn new(seed: u64) -> Self {
        Self { seed, rng: ChaCha8Rng::seed_from_u64(seed), target: None, decisions_left: 0 }
    }

    fn draw(&mut self, view: &DiscoveryView<'_>) -> Option<(f64, f64)> {
        let n = view.travel_m.iter().filter(|t| t.is_finite()).count();
        let chosen = self.rng.random_range(0..n.max(1) as u64) as usize;
        let (index, _) = view.travel_m.iter().enumerate().filter(|(_, t)| t.is_finite()).nth(chosen)?;
        let g = &view.map.geometry;
        Some(g.centre(index % g.width, index / g.width))
    }
}

impl GoalDiscovery for RandomGoal {
    fn name(&self) -> &'static str {
        "random-goal"
    }

    fn reset(&mut self) {
        *self = Self::new(self.seed);
    }

    fn next(&mut self, view: &DiscoveryView<'_>) -> Directive {
        let reached = self.target.is_some_and(|(x, y)| view.pose.distance_to(x, y) < REACHED_M);
        if reached || self.decisions_left == 0 {
            self.target = self.draw(view);
            self.decisions_left = DECISIONS;
        }
        self.decisions_left -= 1;
        match self.target {
            Some((x_m, y_m)) => Directive::GoTo { x_m, y_m },
            None => Directive::Act(Action::TurnLeft),
        }
    }

    fn candidates_m(&self) -> Vec<(f64, f64)> {
        self.target.into_iter().collect()
    }
}

#[cfg(test)]
mod tests {
    use homing_core::{GridGeometry, OccupancyGrid, PlanarPose};

    use super::*;

    #[test]
    fn it_keeps_to_what_can_be_reached_and_changes_its_mind_every_ten_decisions() {
        let geometry = GridGeometry { width: 8, height: 8, resolution_m: 1.0, origin_x_m: 0.0, origin_y_m: 0.0 };
        let map = OccupancyGrid::unknown(geometry);
        let travel_m: Vec<f32> = (0..64).map(|i| if i % 8 < 4 { 1.0 } else { f32::INFINITY }).collect();
        let mut drawn = Vec::new();
        let mut policy = RandomGoal::new(3);
        for step in 0..100 {
            let pose = PlanarPose { x_m: -5.0, y_m: -5.0, yaw_rad: 0.0 };
            let view = DiscoveryView { step, pose, map: &map, travel_m: &travel_m, last_motion: None, hints: &[] };
            let Directive::GoTo { x_m, y_m } = policy.next(&view) else { unreachable!("it drives") };
            assert!(x_m < 4.0, "({x_m}, {y_m}) cannot be reached");
            drawn.push((x_m, y_m));
        }
        assert!(drawn.chunks(10).all(|c| c.iter().all(|p| *p == c[0])));
        let mut places: Vec<_> = drawn.chunks(10).map(|c| format!("{:?}", c[0])).collect();
        places.sort();
        places.dedup();
        assert!(places.len() >= 5, "{places:?}");
        policy.reset();
        let view = DiscoveryView {
            step: 0,
            pose: PlanarPose::default(),
            map: &map,
            travel_m: &travel_m,
            last_motion: None,
            hints: &[],
        };
        assert_eq!(policy.next(&view), Directive::GoTo { x_m: drawn[0].0, y_m: drawn[0].1 });
    }
}
