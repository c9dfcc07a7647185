//! The planner is total: no event, however broken, makes it panic or do anything but a valid action.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic, reason = "tests")]

use std::sync::Arc;

use homing_core::*;
use homing_planner::{
    Frontier, Mission, Perception, Planner, PlannerConfig, PlannerObservation, Recovery, StepEvent, Straight,
    SwitchConfig, SwitchKind,
};
use nalgebra::{Isometry3, Matrix6, Quaternion, Translation3, UnitQuaternion, Vector3};
use proptest::prelude::*;

fn wild() -> impl Strategy<Value = f64> {
    prop_oneof![
        8 => -20.0..20.0_f64,
        1 => Just(0.0),
        1 => prop_oneof![Just(f64::NAN), Just(f64::INFINITY), Just(-f64::INFINITY), Just(1e300), Just(-1e-300)],
    ]
}

fn transform<A: Frame, B: Frame>() -> impl Strategy<Value = Transform<A, B>> {
    let upright = (wild(), wild(), wild())
        .prop_map(|(x_m, y_m, yaw_rad)| PlanarPose { x_m, y_m, yaw_rad: yaw_rad % 3.0 }.to_transform());
    let broken = (wild(), wild(), wild(), wild(), wild()).prop_map(|(x, y, a, b, c)| {
        let rotation = UnitQuaternion::new_unchecked(Quaternion::new(a, b, c, 0.3));
        Transform::new(Isometry3::from_parts(Translation3::new(x, y, 0.1), rotation))
    });
    prop_oneof![3 => upright, 1 => broken]
}

fn mount() -> Transform<Base, Camera> {
    let r = nalgebra::Matrix3::new(0.0, 0.0, 1.0, -1.0, 0.0, 0.0, 0.0, -1.0, 0.0);
    Transform::from_rotation(&r, Vector3::new(0.1, 0.0, 1.0))
}

fn observation() -> impl Strategy<Value = PlannerObservation> {
    let depth = (1_u32..24, 1_u32..24, -1.0..12.0_f32, any::<bool>());
    let camera = prop_oneof![3 => Just(mount()), 1 => transform::<Base, Camera>()];
    (0_u64..8_000_000_000, transform::<Odom, Base>(), depth, camera, any::<bool>()).prop_map(
        |(stamp, t_odom_base, (width, height, metres, hole), t_base_camera, fitting)| {
            let n = (width * height) as usize;
            let data = (0..n).map(|i| if hole && i % 3 == 0 { f32::NAN } else { metres + i as f32 * 0.01 }).collect();
            let side = if fitting { (width, height) } else { (height + 1, width) };
            PlannerObservation {
                odometry: Odometry { stamp: Stamp(stamp), t_odom_base, linear_m_s: f64::NAN, angular_rad_s: 0.0 },
                depth: Arc::new(DepthImage::from_metres(width, height, data).unwrap()),
                intrinsics: Intrinsics::from_hfov(side.0, side.1, 2.0).unwrap(),
                t_base_camera,
            }
        },
    )
}

fn sighting() -> impl Strategy<Value = Sighting> {
    prop_oneof![
        Just(Sighting::NotSeen { reason: UnseenReason::NoConsensus }),
        (wild(), wild(), wild(), 0_usize..300).prop_map(|(bearing_rad, bearing_sd_rad, heading_rad, n_inliers)| {
            Sighting::Bearing { bearing_rad, bearing_sd_rad, heading_rad, n_inliers }
        }),
        (transform(), wild(), wild(), 0_usize..300).prop_map(|(t_camera_goal, variance, rms_rad, n_inliers)| {
            Sighting::Pose { t_camera_goal, covariance: Matrix6::identity() * variance, n_inliers, rms_rad }
        }),
    ]
}

fn estimate() -> impl Strategy<Value = GoalEstimate> {
    (0_u64..8_000_000_000, 0_u64..3, sighting(), prop::option::of(any::<f32>())).prop_map(
        |(stamp, goal_id, sighting, switch_probability)| GoalEstimate {
            stamp: Stamp(stamp),
            goal_id,
            sighting,
            switch_probability,
            n_matches: 3,
            matched_points: Vec::new(),
            times: StageTimes::default(),
        },
    )
}

fn event() -> impl Strategy<Value = StepEvent> {
    let mission = prop_oneof![
        12 => Just(None),
        2 => (0_u64..3).prop_map(|goal_id| Some(Mission::Start { goal_id })),
        1 => Just(Some(Mission::Cancel)),
    ];
    let motion = (wild(), wild(), any::<bool>()).prop_map(|(x_m, yaw_rad, blocked)| MotionOutcome {
        stamp: Stamp(0),
        moved: PlanarPose { x_m, y_m: 0.0, yaw_rad },
        blocked,
    });
    let perception = prop_oneof![Just(Perception::Present), Just(Perception::Absent)];
    let remembered = prop::collection::vec(estimate(), 0..3);
    let estimates = (prop::option::of(estimate()), remembered);
    (mission, prop::option::of(observation()), estimates, prop::option::of(motion), perception).prop_map(
        |(mission, observation, (estimate, remembered), motion, perception)| StepEvent {
            mission,
            observation,
            estimate,
            remembered,
            motion,
            perception,
        },
    )
}

fn planner(policy: usize) -> Planner {
    planner_with(policy, SwitchConfig::default())
}

fn planner_with(policy: usize, switches: SwitchConfig) -> Planner {
    let config = PlannerConfig { map_side_m: 12.0, step_budget: 60, switches, ..PlannerConfig::default() };
    let discovery: Box<dyn GoalDiscovery> =
        if policy == 0 { Box::new(Straight::new()) } else { Box::new(Frontier::default()) };
    Planner::new(config, discovery).unwrap()
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 512, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn garbage_never_panics_and_twice_gives_the_same(
        events in prop::collection::vec((0_u64..8_000_000_000, event()), 1..30),
        sorted in any::<bool>(),
        policy in 0_usize..2,
        kind in prop::sample::select(vec![SwitchKind::Fused, SwitchKind::Sling, SwitchKind::LEARNED]),
        recovery in prop::sample::select(vec![Recovery::On, Recovery::Off]),
    ) {
        let switches = SwitchConfig { kind, recovery, ..SwitchConfig::default() };
        let (mut a, mut b) = (planner_with(policy, switches), planner_with(policy, switches));
        let mut events = events;
        if sorted {
            // Plausible clocks let the garbage through to the later stages.
            for (i, (now, event)) in events.iter_mut().enumerate() {
                *now = i as u64 * 200_000_000;
                if let Some(observation) = &mut event.observation {
                    observation.odometry.stamp = Stamp(*now);
                }
                if let Some(estimate) = &mut event.estimate {
                    estimate.stamp = Stamp(*now);
                }
            }
            events[0].1.mission = Some(Mission::Start { goal_id: 1 });
        }
        for (now, event) in &events {
            let action = a.step(Stamp(*now), event);
            prop_assert_eq!(action, b.step(Stamp(*now), event));
            prop_assert_eq!(a.state().action, action);
            if event.observation.is_none() {
                prop_assert_eq!(action, Action::Hold);
            }
            let pose = a.state().pose;
            prop_assert!(pose.x_m.is_finite() && pose.y_m.is_finite() && pose.yaw_rad.is_finite());
            if let Some(goal) = &a.state().goal {
                prop_assert!(goal.pose.x_m.is_finite() && goal.covariance.iter().all(|v| v.is_finite()));
            }
        }
    }
}

/// A level floor with a wall `wall_m` ahead, 64 x 48 pixels.
fn looking_at_a_wall(wall_m: f64, stamp: u64, pose: PlanarPose) -> PlannerObservation {
    let intrinsics = Intrinsics::from_hfov(64, 48, 2.0).unwrap();
    let mut data = Vec::new();
    for row in 0..48 {
        for _ in 0..64 {
            let slope = (f64::from(row) - intrinsics.cy()) / intrinsics.fy();
            data.push((if slope > 0.0 { wall_m.min(1.0 / slope) } else { wall_m }) as f32);
        }
    }
    PlannerObservation {
        odometry: Odometry {
            stamp: Stamp(stamp),
            t_odom_base: pose.to_transform(),
            linear_m_s: 0.0,
            angular_rad_s: 0.0,
        },
        depth: Arc::new(DepthImage::from_metres(64, 48, data).unwrap()),
        intrinsics,
        t_base_camera: mount(),
    }
}

fn start(observation: PlannerObservation) -> StepEvent {
    StepEvent {
        mission: Some(Mission::Start { goal_id: 1 }),
        observation: Some(observation),
        estimate: None,
        remembered: Vec::new(),
        motion: None,
        perception: Perception::Absent,
    }
}

#[test]
fn a_stale_a_missing_and_a_blind_observation_hold() {
    let mut planner = planner(1);
    let seen = looking_at_a_wall(3.0, 5_000_000_000, PlanarPose::default());
    assert_eq!(planner.step(Stamp(9_000_000_000), &start(seen.clone())), Action::Hold);
    assert_eq!(planner.state().reason, "the observation is stale");
    assert_eq!(planner.step(Stamp(5_000_000_000), &StepEvent::nothing()), Action::Hold);
    let mut blind = seen;
    blind.depth = Arc::new(DepthImage::from_metres(64, 48, vec![0.0; 64 * 48]).unwrap());
    assert_eq!(planner.step(Stamp(5_000_000_000), &start(blind)), Action::Hold);
    let own: Vec<_> = planner.map().cells.iter().filter(|c| **c != Cell::Unknown).collect();
    assert!(own.len() < 60, "only the cells under the body are known, not {}", own.len());
}

#[test]
fn too_near_a_wall_to_see_it_turns_away_once_around_and_then_stands() {
    let mut planner = planner(1);
    planner.step(Stamp(0), &start(looking_at_a_wall(0.6, 0, PlanarPose::default())));
    let blind_at = |k: u64| {
        let mut seen = looking_at_a_wall(0.6, k * 500_000_000, PlanarPose::default());
        seen.depth = Arc::new(DepthImage::from_metres(64, 48, vec![0.0; 64 * 48]).unwrap());
        StepEvent { observation: Some(seen), perception: Perception::Present, ..StepEvent::nothing() }
    };
    let actions: Vec<Action> = (1..=30).map(|k| planner.step(Stamp(k * 500_000_000), &blind_at(k))).collect();
    assert!(actions[..24].iter().all(|a| *a == Action::TurnLeft), "{actions:?}");
    assert!(actions[24..].iter().all(|a| *a == Action::Hold), "{actions:?}");
}

#[test]
fn without_perception_it_explores_and_says_so() {
    let mut planner = planner(1);
    let action = planner.step(Stamp(0), &start(looking_at_a_wall(3.0, 0, PlanarPose::default())));
    assert!(matches!(action, Action::TurnLeft | Action::TurnRight | Action::Forward));
    assert_eq!(planner.state().mode, Mode::Explore);
    assert!(planner.state().reason.contains("perception is not running"), "{}", planner.state().reason);
}

#[test]
fn a_jump_of_the_odometry_holds_once_and_begins_a_new_map() {
    let mut planner = planner(1);
    planner.step(Stamp(0), &start(looking_at_a_wall(3.0, 0, PlanarPose::default())));
    let free = |p: &Planner| p.map().cells.iter().filter(|c| **c == Cell::Free).count();
    let before = free(&planner);
    let carried = PlanarPose { x_m: 3.0, y_m: 0.0, yaw_rad: 3.0 };
    let mut event = start(looking_at_a_wall(3.0, 200_000_000, carried));
    event.mission = None;
    assert_eq!(planner.step(Stamp(200_000_000), &event), Action::Hold);
    assert!(planner.state().reason.contains("jumped"));
    assert!(free(&planner) <= before, "the old map is gone");
    event.observation = Some(looking_at_a_wall(3.0, 400_000_000, carried));
    assert_ne!(planner.step(Stamp(400_000_000), &event), Action::Hold);
}

#[test]
fn a_goal_beside_is_driven_to_turned_to_and_stopped_at() {
    let mut planner = planner(1);
    let goal = PlanarPose { x_m: 1.0, y_m: 0.5, yaw_rad: 1.2 };
    let mut pose = PlanarPose::default();
    let mut event = start(looking_at_a_wall(4.0, 0, pose));
    let mut n = 0;
    loop {
        let stamp = n * 200_000_000;
        event.observation = Some(looking_at_a_wall(4.0 - pose.x_m, stamp, pose));
        let (here, there): (Transform<Odom, Base>, Transform<Odom, Base>) = (pose.to_transform(), goal.to_transform());
        // The photo was taken 40 cm higher and pitched down: harmless on the floor.
        let tilt: Transform<Goal, Goal> = Transform::new(Isometry3::from_parts(
            Translation3::new(0.0, -0.4, 0.0),
            UnitQuaternion::from_axis_angle(&Vector3::x_axis(), -0.2),
        ));
        let camera_goal = mount().inverse() * (here.inverse() * there) * mount();
        let t_camera_goal: Transform<Camera, Goal> = Transform::new(*camera_goal.isometry());
        event.estimate = Some(GoalEstimate {
            stamp: Stamp(stamp),
            goal_id: 1,
            sighting: Sighting::Pose {
                t_camera_goal: t_camera_goal * tilt,
                covariance: Matrix6::identity() * 1e-3,
                n_inliers: 60,
                rms_rad: 0.003,
            },
            switch_probability: None,
            n_matches: 80,
            matched_points: Vec::new(),
            times: StageTimes::default(),
        });
        event.perception = Perception::Present;
        let action = planner.step(Stamp(stamp), &event);
        event.mission = None;
        let (forward, turn) = match action {
            Action::Forward => (0.25, 0.0),
            Action::TurnLeft => (0.0, 15_f64.to_radians()),
            Action::TurnRight => (0.0, -15_f64.to_radians()),
            Action::Face { milliradians } => (0.0, 1e-3 * f64::from(milliradians)),
            Action::Stop => break,
            Action::Hold => (0.0, 0.0),
        };
        pose = PlanarPose {
            x_m: pose.x_m + forward * libm::cos(pose.yaw_rad),
            y_m: pose.y_m + forward * libm::sin(pose.yaw_rad),
            yaw_rad: wrap_angle(pose.yaw_rad + turn),
        };
        n += 1;
        assert!(n < 40, "{}", planner.state().reason);
    }
    assert_eq!(planner.state().mode, Mode::Arrived);
    assert!(pose.distance_to(goal.x_m, goal.y_m) < 0.2, "{pose:?}");
    assert!(wrap_angle(pose.yaw_rad - goal.yaw_rad).abs() < 0.7_f64.to_radians(), "{pose:?}");
}

/// What perception says of an image taken at `stamp` from the origin: the goal lies 2.5 m ahead.
fn ahead_of_the_origin(stamp: u64) -> GoalEstimate {
    let t_camera_goal = Transform::new(Isometry3::translation(0.0, 0.0, 2.5));
    GoalEstimate {
        stamp: Stamp(stamp),
        goal_id: 1,
        sighting: Sighting::Pose {
            t_camera_goal,
            covariance: Matrix6::identity() * 1e-3,
            n_inliers: 60,
            rms_rad: 0.003,
        },
        switch_probability: None,
        n_matches: 80,
        matched_points: Vec::new(),
        times: StageTimes::default(),
    }
}

#[test]
fn a_goal_seen_before_its_photo_was_given_is_driven_to_at_once() {
    let mut planner = planner(1);
    // Without a mission the body is led forward and about, and sees the goal only at the first moment.
    for i in 0..10_u32 {
        let pose = PlanarPose { x_m: 0.1 * f64::from(i), y_m: 0.0, yaw_rad: 0.2 * f64::from(i) };
        let stamp = u64::from(i) * 200_000_000;
        let seen = StepEvent { observation: Some(looking_at_a_wall(4.0, stamp, pose)), ..StepEvent::nothing() };
        assert_eq!(planner.step(Stamp(stamp), &seen), Action::Hold);
    }
    let known = planner.map().cells.iter().filter(|c| **c == Cell::Free).count();
    let here = PlanarPose { x_m: 0.9, y_m: 0.0, yaw_rad: 1.8 };
    let mut event = start(looking_at_a_wall(4.0, 2_000_000_000, here));
    event.perception = Perception::Present;
    event.remembered = vec![ahead_of_the_origin(0)];
    let action = planner.step(Stamp(2_000_000_000), &event);
    assert!(planner.map().cells.iter().filter(|c| **c == Cell::Free).count() > known * 9 / 10, "the map was forgotten");
    let goal = planner.state().goal.clone().unwrap().pose;
    assert!(goal.distance_to(2.5, 0.0) < 0.01 && goal.yaw_rad.abs() < 0.01, "{goal:?}");
    assert_eq!((planner.state().mode, action), (Mode::Exploit, Action::TurnRight), "{}", planner.state().reason);
}

#[test]
fn an_image_from_before_the_odometry_is_nowhere() {
    let mut planner = planner(1);
    let mut event = start(looking_at_a_wall(4.0, 2_000_000_000, PlanarPose::default()));
    event.remembered = vec![ahead_of_the_origin(1_000_000_000)];
    planner.step(Stamp(2_000_000_000), &event);
    assert_eq!((planner.state().mode, planner.state().goal.clone()), (Mode::Explore, None));
}

#[test]
fn the_same_goal_given_again_is_where_it_was() {
    let mut planner = planner(1);
    let mut event = start(looking_at_a_wall(4.0, 0, PlanarPose::default()));
    event.estimate = Some(ahead_of_the_origin(0));
    planner.step(Stamp(0), &event);
    let cancelled = StepEvent { mission: Some(Mission::Cancel), ..StepEvent::nothing() };
    planner.step(Stamp(0), &cancelled);
    assert_eq!((planner.state().mode, planner.state().goal.clone()), (Mode::Idle, None));
    let mut again = start(looking_at_a_wall(4.0, 200_000_000, PlanarPose::default()));
    again.perception = Perception::Present;
    planner.step(Stamp(200_000_000), &again);
    assert_eq!(planner.state().mode, Mode::Exploit);
    again.mission = Some(Mission::Start { goal_id: 2 });
    planner.step(Stamp(200_000_000), &again);
    assert_eq!((planner.state().mode, planner.state().goal.clone()), (Mode::Explore, None), "another goal");
}

#[test]
fn impossible_knobs_are_refused_by_name() {
    let config = PlannerConfig { resolution_m: f64::NAN, ..PlannerConfig::default() };
    let error = Planner::new(config, Box::new(Straight::new())).err().unwrap();
    assert!(error.to_string().starts_with("resolution_m"), "{error}");
}
