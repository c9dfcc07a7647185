//! Oracle-GD: goal discovery that always takes the step that brings the goal nearest (SLING 4.2).

use std::sync::Arc;

use homing_core::{Action, Directive, DiscoveryView, GoalDiscovery, Motion, wrap_angle};

use super::in_world;
use crate::arena::Arena;
use crate::body::{Body, Sliding};
use crate::constants::TURN_RAD;
use crate::episode::Episode;
use crate::follower::next_motion;
use crate::geodesic::{GeodesicField, GoalBlocked};

/// Follows the shortest path, and looks the photo's way at its end.
#[derive(Debug)]
pub struct OracleDiscovery {
    arena: Arc<Arena>,
    field: GeodesicField,
    episode: Episode,
}

impl OracleDiscovery {
    /// For one episode.
    ///
    /// # Errors
    /// [`GoalBlocked`] for a goal that the robot cannot reach.
    pub fn new(arena: &Arc<Arena>, episode: &Episode) -> Result<Self, GoalBlocked> {
        let field = GeodesicField::to(arena.space(), (episode.goal.x_m, episode.goal.y_m))?;
        Ok(Self { arena: Arc::clone(arena), field, episode: episode.clone() })
    }
}

impl GoalDiscovery for OracleDiscovery {
    fn name(&self) -> &'static str {
        "oracle-gd"
    }

    fn reset(&mut self) {}

    fn next(&mut self, view: &DiscoveryView<'_>) -> Directive {
        let pose = in_world(&self.episode, &view.pose);
        let body = Body { pose, radius_m: self.arena.size().radius_m, sliding: Sliding::Off };
        match next_motion(&body, self.arena.grid(), &self.field) {
            Some(Motion::Forward { .. }) => Directive::Act(Action::Forward),
            Some(Motion::Turn { angle_rad }) if angle_rad > 0.0 => Directive::Act(Action::TurnLeft),
            Some(_) => Directive::Act(Action::TurnRight),
            None => self.face_the_goal(pose.yaw_rad),
        }
    }
}

impl OracleDiscovery {
    /// At the goal's place: perception sees the photo's view once the robot looks its way.
    fn face_the_goal(&self, yaw_rad: f64) -> Directive {
        let left_rad = wrap_angle(self.episode.goal.yaw_rad - yaw_rad);
        if left_rad.abs() <= 0.5 * TURN_RAD + 1e-6 {
            return Directive::Act(Action::Hold);
        }
        Directive::Act(if left_rad > 0.0 { Action::TurnLeft } else { Action::TurnRight })
    }
}

#[cfg(test)]
#[expect(clippy::unwrap_used, reason = "a test may fail by panicking")]
mod tests {
    use homing_core::{GridGeometry, OccupancyGrid, Resettable, RobotBridge};

    use super::*;
    use crate::arena::{BodySize, SceneRef};
    use crate::constants::FORWARD_M;
    use crate::episode::{EpisodeSpec, draw};
    use crate::flat::Detail;
    use crate::simulator::{SimConfig, Simulator};

    #[test]
    fn it_drives_the_shortest_way_and_looks_the_photos_way() {
        let arena = Arc::new(Arena::load_as(&SceneRef::Flat { seed: 5 }, BodySize::default(), Detail::Shape).unwrap());
        let episode = draw(&arena, 5, &EpisodeSpec::default()).unwrap();
        let mut robot = Simulator::new(Arc::clone(&arena), SimConfig::default()).unwrap();
        robot.reset(&episode).unwrap();
        let mut oracle = OracleDiscovery::new(&arena, &episode).unwrap();
        let geometry = GridGeometry { width: 1, height: 1, resolution_m: 1.0, origin_x_m: 0.0, origin_y_m: 0.0 };
        let map = OccupancyGrid::unknown(geometry);
        for step in 0..300 {
            let view = DiscoveryView {
                step,
                pose: robot.odometry().t_odom_base.planar(),
                map: &map,
                travel_m: &[0.0],
                last_motion: None,
                hints: &[],
            };
            let Directive::Act(action) = oracle.next(&view) else { unreachable!("it acts") };
            if action == Action::Hold {
                break;
            }
            robot.apply(action.motion(FORWARD_M, TURN_RAD)).unwrap();
        }
        robot.apply(Motion::Stop { done: true }).unwrap();
        let score = robot.score_truth(&episode);
        assert!(score.success && score.spl > 0.85 && score.final_heading_error_deg <= 7.6, "{score:?}");
    }
}
