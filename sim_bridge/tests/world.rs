//! What must hold of every flat and of everything that drives in one.

#![expect(clippy::unwrap_used, reason = "a test may fail by panicking")]

use core::time::Duration;
use std::sync::Arc;

use homing_core::{BridgeError, Motion, PlanarPose, Resettable, RobotBridge};
use homing_sim::arena::{Arena, BodySize, SceneRef};
use homing_sim::body::{Body, Sliding};
use homing_sim::constants::{CURVED_HEADING_RAD, CURVED_RATIO, FORWARD_M, TURN_RAD};
use homing_sim::episode::{self, EpisodeSpec, GoalPlace, Shape};
use homing_sim::flat::{Detail, generate_as};
use homing_sim::follower::next_motion;
use homing_sim::geodesic::GeodesicField;
use homing_sim::nav_grid::{NavGrid, NavGridError};
use homing_sim::scene::{Mesh, Scene, Vertex};
use homing_sim::simulator::{SimConfig, Simulator};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rayon::prelude::*;

fn arena(seed: u64) -> Arena {
    Arena::load_as(&SceneRef::Flat { seed }, BodySize::default(), Detail::Shape).unwrap()
}

#[test]
fn every_door_and_room_of_fifty_flats_is_within_reach_of_every_robot() {
    (0..50_u64).into_par_iter().for_each(|seed| {
        let flat = generate_as(seed, Detail::Shape);
        let grid = NavGrid::new(&flat.scene, 1.5).unwrap();
        for radius_m in [0.1, 0.18, 0.2] {
            let space = grid.free_space(&flat.scene.name, radius_m).unwrap();
            for door in &flat.doors {
                let (x, y) = door.centre();
                assert!(space.contains(x, y), "seed {seed}, radius {radius_m}: door {door:?}");
            }
            let g = space.geometry();
            for room in &flat.rooms {
                let inside = |i: &usize| {
                    let (x, y) = g.centre(i % g.width, i / g.width);
                    space.cells()[*i] && room.floor.contains(x, y)
                };
                let area = (0..g.len()).filter(inside).count() as f64 * g.resolution_m * g.resolution_m;
                let share = area / room.floor.area();
                assert!(share > 0.2, "seed {seed}, radius {radius_m}: {share:.2} of {:?} left", room.kind);
            }
        }
    });
}

/// A floor of 4 m by 4 m with a thin wall from (2, 0) to (2, 3).
fn walled_square() -> Scene {
    let quad = |corners: [[f32; 3]; 4]| Mesh {
        vertices: corners.map(|position| Vertex { position, normal: [0.0, 0.0, 1.0], uv: [0.0; 2] }).to_vec(),
        triangles: vec![[0, 1, 2], [0, 2, 3]],
        material: 0,
        colours: Vec::new(),
        solid: true,
    };
    let floor = quad([[0.0, 0.0, 0.0], [4.0, 0.0, 0.0], [4.0, 4.0, 0.0], [0.0, 4.0, 0.0]]);
    let wall = quad([[2.0, 0.0, 0.0], [2.0, 3.0, 0.0], [2.0, 3.0, 2.0], [2.0, 0.0, 2.0]]);
    Scene { name: "square".into(), meshes: vec![floor, wall], ..Scene::default() }
}

#[test]
fn the_way_around_a_wall_has_the_length_of_the_taut_string() {
    let grid = NavGrid::new(&walled_square(), 1.5).unwrap();
    let radius = 0.18;
    let space = Arc::new(grid.free_space("square", radius).unwrap());
    let field = GeodesicField::to(&space, (3.0, 1.0)).unwrap();
    assert!((field.distance_m(3.0, 2.5).unwrap() - 1.5).abs() < 1e-9, "a straight way is exact");
    // A taut string: tangents from both points to the circle of the robot's radius around the wall's end, and the arc
    // between them. On the grid the wall is up to a cell thicker and longer.
    let taut = |r: f64| {
        let far = f64::hypot(1.0, 2.0);
        let arc = core::f64::consts::TAU - 2.0 * 0.5_f64.atan() - 2.0 * (r / far).acos();
        2.0 * (far * far - r * r).sqrt() + r * arc
    };
    let found = field.distance_m(1.0, 1.0).unwrap();
    let (low, high) = (taut(radius) - 0.02, taut(radius + 0.05) + 0.06);
    assert!((low..high).contains(&found), "{found} is not in {low}..{high}");
    let path = field.path(1.0, 1.0).unwrap();
    let length: f64 = path.windows(2).map(|p| f64::hypot(p[1].0 - p[0].0, p[1].1 - p[0].1)).sum();
    assert!((length - found).abs() < 0.06, "path of {length} m for a distance of {found} m");
    assert!(path.windows(2).all(|p| space.line_is_free(p[0], p[1])));
}

#[test]
fn a_scene_without_floor_is_refused() {
    let mut scene = walled_square();
    scene.meshes.remove(0);
    assert!(matches!(NavGrid::new(&scene, 1.5), Err(NavGridError::NoFloor { .. })));
    let grid = NavGrid::new(&walled_square(), 1.5).unwrap();
    assert!(matches!(grid.free_space("square", 1.9), Err(NavGridError::NoFloor { .. })));
}

#[test]
fn with_sliding_off_contact_stops_the_robot_and_with_it_on_the_robot_glides() {
    let grid = NavGrid::new(&walled_square(), 1.5).unwrap();
    let start = PlanarPose { x_m: 1.5, y_m: 1.0, yaw_rad: 0.6 };
    let mut body = Body { pose: start, radius_m: 0.18, sliding: Sliding::Off };
    let travel = body.advance(&grid, 1.0);
    assert!(travel.blocked && travel.path_m < 0.45, "{travel:?}");
    assert!((body.pose.x_m - (2.0 - 0.18)).abs() < 0.026, "{:?}", body.pose);
    let again = body.advance(&grid, 0.25);
    assert!(again.blocked && again.path_m < 1e-3);
    let mut glider = Body { pose: start, radius_m: 0.18, sliding: Sliding::On };
    assert!(glider.advance(&grid, 1.0).blocked);
    assert!(glider.pose.y_m > body.pose.y_m + 0.2 && glider.pose.x_m < 2.0 - 0.18);
    let mut free = Body { pose: PlanarPose { yaw_rad: 1.5, ..start }, radius_m: 0.18, sliding: Sliding::Off };
    let travel = free.advance(&grid, 0.25);
    assert!(!travel.blocked && (travel.path_m - 0.25).abs() < 1e-12);
}

#[test]
fn whatever_it_does_a_robot_never_overlaps_an_obstacle() {
    (0..6_u64).into_par_iter().for_each(|seed| {
        let arena = arena(seed);
        let rng = &mut ChaCha8Rng::seed_from_u64(seed);
        for radius_m in [0.1, 0.18] {
            let space = arena.grid().free_space("flat", radius_m - 0.03).unwrap();
            let start = arena.space().nth(rng.random_range(0..arena.space().len() as u64) as usize).unwrap();
            let sliding = if rng.random_bool(0.5) { Sliding::On } else { Sliding::Off };
            let pose = PlanarPose { x_m: start.0, y_m: start.1, yaw_rad: 0.0 };
            let mut body = Body { pose, radius_m, sliding };
            for step in 0..600 {
                let before = body.pose;
                match rng.random_range(0..3_u32) {
                    0 => body.turn(rng.random_range(-2.0..2.0)),
                    1 => drop(body.advance(arena.grid(), rng.random_range(-0.3..1.5))),
                    _ => drop(body.drive(arena.grid(), rng.random_range(-1.0..3.0), rng.random_range(-2.0..2.0), 0.4)),
                }
                let p = body.pose;
                assert!(arena.grid().disc_is_free(p.x_m, p.y_m, radius_m), "seed {seed} step {step}: {before:?} {p:?}");
                // A disc that had jumped through a wall would be outside the space that hangs together.
                assert!(space.contains(p.x_m, p.y_m), "seed {seed} step {step}: {before:?} {p:?}");
            }
        }
    });
}

#[test]
fn episodes_are_what_was_asked_for() {
    (0..12_u64).into_par_iter().for_each(|seed| {
        let arena = arena(seed);
        for shape in [Shape::Curved, Shape::Straight] {
            let spec = EpisodeSpec { shape: Some(shape), ..EpisodeSpec::default() };
            let e = episode::draw(&arena, seed, &spec).unwrap();
            assert_eq!(e, episode::draw(&arena, seed, &spec).unwrap());
            let field = GeodesicField::to(arena.space(), (e.goal.x_m, e.goal.y_m)).unwrap();
            let geodesic = field.distance_m(e.start.x_m, e.start.y_m).unwrap();
            assert!((3.0..=10.0).contains(&geodesic) && (geodesic - e.shortest_path_m).abs() < 1e-4);
            let straight = f64::hypot(e.goal.x_m - e.start.x_m, e.goal.y_m - e.start.y_m);
            assert!(geodesic > straight - 0.02, "seed {seed}: {geodesic} < {straight}");
            let turned = homing_core::wrap_angle(e.goal.yaw_rad - e.start.yaw_rad).abs() >= CURVED_HEADING_RAD;
            assert_eq!(shape == Shape::Curved, geodesic >= CURVED_RATIO * straight || turned);
            let json = serde_json::to_string(&e).unwrap();
            assert_eq!(serde_json::from_str::<episode::Episode>(&json).unwrap(), e);
        }
        let spec = EpisodeSpec { goal_place: GoalPlace::OtherRoom, min_m: 5.0, ..EpisodeSpec::default() };
        let e = episode::draw(&arena, seed, &spec).unwrap();
        assert_ne!(arena.room_at(e.start.x_m, e.start.y_m), arena.room_at(e.goal.x_m, e.goal.y_m));
    });
}

#[test]
fn the_goal_can_be_reached_by_the_discrete_actions() {
    for seed in 0..4 {
        let arena = Arc::new(arena(seed));
        let e = episode::draw(&arena, seed, &EpisodeSpec::default()).unwrap();
        let mut robot = Simulator::new(arena.clone(), SimConfig::default()).unwrap();
        robot.reset(&e).unwrap();
        let field = GeodesicField::to(arena.space(), (e.goal.x_m, e.goal.y_m)).unwrap();
        for _ in 0..400 {
            let Some(motion) = next_motion(robot.body_truth(), arena.grid(), &field) else { break };
            robot.apply(motion).unwrap();
        }
        robot.apply(Motion::Stop { done: true }).unwrap();
        let score = robot.score_truth(&e);
        assert!(score.success && score.spl > 0.85 && score.final_distance_m < 0.25, "seed {seed}: {score:?}");
    }
}

#[test]
fn equal_actions_give_equal_observations_bit_for_bit() {
    let config = || {
        let mut c = SimConfig::default();
        (c.camera.width, c.camera.height) = (160, 120);
        c
    };
    let run = || {
        let arena = Arc::new(Arena::load(&SceneRef::Flat { seed: 5 }, BodySize::default()).unwrap());
        let e = episode::draw(&arena, 5, &EpisodeSpec::default()).unwrap();
        let mut robot = Simulator::new(arena, config()).unwrap();
        robot.reset(&e).unwrap();
        let first = robot.observe().unwrap();
        assert_eq!(first.odometry.t_odom_base.planar(), PlanarPose::default(), "odometry begins at identity");
        let rng = &mut ChaCha8Rng::seed_from_u64(1);
        let mut seen = vec![first];
        for _ in 0..50 {
            let motion = match rng.random_range(0..4_u32) {
                0 => Motion::Turn { angle_rad: TURN_RAD },
                1 => Motion::Turn { angle_rad: -TURN_RAD },
                2 => Motion::Velocity { linear_m_s: 0.4, angular_rad_s: 0.3 },
                _ => Motion::Forward { distance_m: FORWARD_M },
            };
            robot.apply(motion).unwrap();
            seen.push(robot.observe().unwrap());
            assert_eq!(*seen.last().unwrap(), robot.observe().unwrap(), "looking changes nothing");
        }
        seen
    };
    let (a, b) = (run(), run());
    assert!(a == b);
    assert!(a.windows(2).any(|w| w[0].frame.rgb != w[1].frame.rgb));
}

#[test]
fn time_odometry_and_refusals_are_as_promised() {
    let arena = Arc::new(arena(3));
    let e = episode::draw(&arena, 3, &EpisodeSpec::default()).unwrap();
    let mut robot = Simulator::new(arena, SimConfig::default()).unwrap();
    robot.reset(&e).unwrap();
    let turn = robot.apply(Motion::Turn { angle_rad: TURN_RAD }).unwrap();
    assert_eq!(turn.stamp.0, 500_000_000);
    assert!((turn.moved.yaw_rad - TURN_RAD).abs() < 1e-12 && !turn.blocked);
    let ahead = robot.apply(Motion::Forward { distance_m: FORWARD_M }).unwrap();
    assert_eq!(ahead.stamp.0, 1_000_000_000);
    assert!((ahead.moved.x_m - FORWARD_M).abs() < 1e-9 || ahead.blocked);
    let odometry = robot.odometry().t_odom_base.planar();
    assert!((odometry.yaw_rad - TURN_RAD).abs() < 1e-12);
    assert!(odometry.distance_to(0.0, 0.0) <= FORWARD_M + 1e-9);
    let drive = robot.step_velocity(9.0, 0.0, Duration::from_millis(200)).unwrap();
    assert!(drive.moved.x_m <= 0.1 + 1e-9, "the speed limit holds: {drive:?}");
    let refused = robot.apply(Motion::Forward { distance_m: f64::NAN });
    assert!(matches!(refused, Err(BridgeError::NotFinite { .. })));
    let elsewhere = episode::Episode { scene: SceneRef::Flat { seed: 4 }, ..e };
    assert!(robot.reset(&elsewhere).is_err());
}
