//! The kinds of switches, in the planner: what is driven to, when it is given up, and where the robot stops.
#![expect(clippy::unwrap_used, reason = "a test may fail by panicking")]

use std::sync::Arc;

use homing_core::*;
use homing_planner::{
    Frontier, Mission, Perception, Planner, PlannerConfig, PlannerObservation, Recovery, StepEvent, SwitchConfig,
    SwitchKind, UnknownCells,
};
use nalgebra::{Matrix3, Matrix6, Vector3};

const STEP_NS: u64 = 200_000_000;

/// A planner on a level floor with a wall far ahead, and where it drove.
struct Drive {
    planner: Planner,
    pose: PlanarPose,
    stamp: u64,
}

fn mount() -> Transform<Base, Camera> {
    let r = Matrix3::new(0.0, 0.0, 1.0, -1.0, 0.0, 0.0, 0.0, -1.0, 0.0);
    Transform::from_rotation(&r, Vector3::new(0.0, 0.0, 1.0))
}

fn at(x_m: f64, y_m: f64, yaw_rad: f64) -> PlanarPose {
    PlanarPose { x_m, y_m, yaw_rad }
}

const UNSEEN: Sighting = Sighting::NotSeen { reason: UnseenReason::NoConsensus };

impl Drive {
    fn new(kind: SwitchKind, recovery: Recovery) -> Self {
        Self::with(PlannerConfig {
            switches: SwitchConfig { kind, recovery, ..SwitchConfig::default() },
            ..PlannerConfig::default()
        })
    }

    fn with(config: PlannerConfig) -> Self {
        let config = PlannerConfig { map_side_m: 16.0, ..config };
        let planner = Planner::new(config, Box::new(Frontier::default())).unwrap();
        Self { planner, pose: PlanarPose::default(), stamp: 0 }
    }

    fn observation(&self) -> PlannerObservation {
        let (intrinsics, wall_m) = (Intrinsics::from_hfov(64, 48, 2.0).unwrap(), 6.0 - self.pose.x_m);
        let row = |row: u32| {
            let slope = (f64::from(row) - intrinsics.cy()) / intrinsics.fy();
            (if slope > 0.0 { wall_m.min(1.0 / slope) } else { wall_m }) as f32
        };
        PlannerObservation {
            odometry: Odometry {
                stamp: Stamp(self.stamp),
                t_odom_base: self.pose.to_transform(),
                linear_m_s: 0.0,
                angular_rad_s: 0.0,
            },
            depth: Arc::new(DepthImage::from_metres(64, 48, (0..64 * 48).map(|i| row(i / 64)).collect()).unwrap()),
            intrinsics,
            t_base_camera: mount(),
        }
    }

    /// The goal at `goal` in the odometry frame, seen from here.
    fn seen(&self, goal: PlanarPose, n_inliers: usize) -> Sighting {
        let (here, there): (Transform<Odom, Base>, Transform<Odom, Base>) =
            (self.pose.to_transform(), goal.to_transform());
        let camera_goal = mount().inverse() * (here.inverse() * there) * mount();
        Sighting::Pose {
            t_camera_goal: Transform::new(*camera_goal.isometry()),
            covariance: Matrix6::identity() * 1e-3,
            n_inliers,
            rms_rad: 0.003,
        }
    }

    fn step(&mut self, sighting: Sighting, switch_probability: Option<f32>) -> Action {
        let estimate = GoalEstimate {
            stamp: Stamp(self.stamp),
            goal_id: 1,
            sighting,
            switch_probability,
            n_matches: 80,
            matched_points: Vec::new(),
            times: StageTimes::default(),
        };
        let event = StepEvent {
            mission: (self.stamp == 0).then_some(Mission::Start { goal_id: 1 }),
            observation: Some(self.observation()),
            estimate: Some(estimate),
            remembered: Vec::new(),
            motion: None,
            perception: Perception::Present,
        };
        let action = self.planner.step(Stamp(self.stamp), &event);
        let (forward, turn) = match action {
            Action::Forward => (0.25, 0.0),
            Action::TurnLeft => (0.0, 15_f64.to_radians()),
            Action::TurnRight => (0.0, -15_f64.to_radians()),
            Action::Face { milliradians } => (0.0, 1e-3 * f64::from(milliradians)),
            Action::Stop | Action::Hold => (0.0, 0.0),
        };
        let (x_m, y_m) = (
            self.pose.x_m + forward * libm::cos(self.pose.yaw_rad),
            self.pose.y_m + forward * libm::sin(self.pose.yaw_rad),
        );
        self.pose = at(x_m, y_m, wrap_angle(self.pose.yaw_rad + turn));
        self.stamp += STEP_NS;
        action
    }

    fn mode(&self) -> Mode {
        self.planner.state().mode
    }

    /// The goal driven to, and how many estimates stand behind it.
    fn goal(&self) -> Option<(PlanarPose, usize)> {
        self.planner.state().goal.as_ref().map(|g| (g.pose, g.n_fused))
    }
}

#[test]
fn sling_drives_to_its_last_prediction_alone() {
    let mut drive = Drive::new(SwitchKind::Sling, Recovery::On);
    for goal in [at(2.0, 0.0, 0.0), at(2.3, 0.1, 0.1), at(1.5, -0.4, 0.0)] {
        drive.step(drive.seen(goal, 60), None);
        assert_eq!(drive.mode(), Mode::Exploit);
        let (believed, n_fused) = drive.goal().unwrap();
        assert!(believed.distance_to(goal.x_m, goal.y_m) < 1e-9 && n_fused == 1, "{believed:?}");
    }
    // What our own switches make of the same: the first two are one place, and it is not the last.
    let mut fused = Drive::new(SwitchKind::Fused, Recovery::On);
    for goal in [at(2.0, 0.0, 0.0), at(2.05, 0.02, 0.01)] {
        fused.step(fused.seen(goal, 60), None);
    }
    let (believed, n_fused) = fused.goal().unwrap();
    assert!(n_fused == 2 && believed.x_m > 2.0 && believed.x_m < 2.05, "{believed:?}");
}

#[test]
fn sling_gives_up_where_the_optimisation_fails_or_the_goal_is_far() {
    for far in [false, true] {
        let mut drive = Drive::new(SwitchKind::Sling, Recovery::On);
        let few = drive.seen(at(2.0, 0.0, 0.0), 15);
        drive.step(few, None);
        assert_eq!((drive.mode(), drive.goal()), (Mode::Explore, None), "15 matches are not more than 15");
        let enough = drive.seen(at(2.0, 0.0, 0.0), 16);
        drive.step(enough, None);
        assert_eq!(drive.mode(), Mode::Exploit);
        let speaks_against = if far { drive.seen(at(4.5, 0.0, 0.0), 99) } else { UNSEEN };
        drive.step(speaks_against, None);
        assert_eq!((drive.mode(), drive.goal()), (Mode::Explore, None));
    }
}

#[test]
fn sling_stops_at_a_goal_that_it_sees_to_the_end() {
    let mut drive = Drive::new(SwitchKind::Sling, Recovery::On);
    let goal = at(1.5, 0.4, 0.6);
    let n = (0..60).take_while(|_| drive.step(drive.seen(goal, 60), None) != Action::Stop).count();
    assert!(n < 30, "{}", drive.planner.state().reason);
    assert_eq!(drive.mode(), Mode::Arrived);
    assert!(drive.pose.distance_to(goal.x_m, goal.y_m) < 0.2, "{:?}", drive.pose);
    assert!(wrap_angle(drive.pose.yaw_rad - goal.yaw_rad).abs() < 0.02, "{:?}", drive.pose);
}

#[test]
fn without_recovery_every_kind_goes_where_it_once_saw_the_goal_and_stops() {
    let goal = at(1.5, 0.4, 0.6);
    for kind in [SwitchKind::Fused, SwitchKind::Sling, SwitchKind::LEARNED] {
        let ends = |recovery| {
            let mut drive = Drive::new(kind, recovery);
            drive.step(drive.seen(goal, 60), Some(0.9));
            assert_eq!(drive.mode(), Mode::Exploit);
            let mut left = false;
            for _ in 0..60 {
                let action = drive.step(UNSEEN, Some(0.0));
                left |= drive.mode() == Mode::Explore;
                if action == Action::Stop {
                    break;
                }
            }
            (left, drive)
        };
        let (left, drive) = ends(Recovery::Off);
        assert!(!left && drive.mode() == Mode::Arrived, "{kind:?}: {}", drive.planner.state().reason);
        assert!(drive.pose.distance_to(goal.x_m, goal.y_m) < 0.2, "{kind:?}: {:?}", drive.pose);
        assert!(ends(Recovery::On).0, "{kind:?} finds its way back");
    }
}

#[test]
fn without_recovery_a_goal_that_no_way_leads_to_is_the_end() {
    for (recovery, mode) in [(Recovery::On, Mode::Explore), (Recovery::Off, Mode::Arrived)] {
        let mut drive = Drive::with(PlannerConfig {
            switches: SwitchConfig {
                kind: SwitchKind::Sling,
                recovery,
                distance_max_m: 9.0,
                ..SwitchConfig::default()
            },
            unknown_cells: UnknownCells::Closed,
            ..PlannerConfig::default()
        });
        // Behind the wall.
        let behind = drive.seen(at(7.5, 0.0, 0.0), 60);
        let action = drive.step(behind, None);
        assert_eq!(drive.mode(), mode, "{}", drive.planner.state().reason);
        assert_eq!(action == Action::Stop, recovery == Recovery::Off);
    }
}

#[test]
fn a_learned_switch_enters_by_likeness_and_leaves_by_geometry() {
    let mut drive = Drive::new(SwitchKind::LEARNED, Recovery::On);
    let goal = at(2.0, 0.0, 0.0);
    for (n_inliers, probability, mode) in [
        (99, None, Mode::Explore),
        (99, Some(0.55), Mode::Explore),
        (7, Some(0.56), Mode::Exploit),
        // Once on the way, likeness does not count.
        (7, Some(0.0), Mode::Exploit),
    ] {
        drive.step(drive.seen(goal, n_inliers), probability);
        assert_eq!(drive.mode(), mode, "{n_inliers} matches, {probability:?}");
    }
    drive.step(UNSEEN, Some(1.0));
    assert_eq!(drive.mode(), Mode::Explore);
}
