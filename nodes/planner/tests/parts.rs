//! The planner's parts, each against what can be worked out by hand.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic, reason = "tests")]

mod world;

use homing_core::*;
use homing_planner::*;
use nalgebra::{Matrix6, Vector3};
use world::World;

const LEVEL: PlanarPose = PlanarPose { x_m: 0.0, y_m: 0.0, yaw_rad: 0.0 };

fn everything(g: &GridGeometry) -> Window {
    Window { column_min: 1, column_max: g.width - 1, row_min: 1, row_max: g.height - 1 }
}

/// What a level camera 1.25 m up sees of an endless wall across its way, 160 x 120 pixels, 120 degrees.
fn wall_at(wall_m: f32, lower_edge_m: f32) -> (DepthImage, Intrinsics) {
    let intrinsics = Intrinsics::from_hfov(160, 120, 120_f64.to_radians()).unwrap();
    let mut data = Vec::new();
    for row in 0..120 {
        for _ in 0..160 {
            let slope = ((intrinsics.cy() - f64::from(row)) / intrinsics.fy()) as f32;
            let on_wall = 1.25 + slope * wall_m >= lower_edge_m;
            data.push(if on_wall { wall_m } else { (1.25 / -slope).min(20.0) });
        }
    }
    (DepthImage::from_metres(160, 120, data).unwrap(), intrinsics)
}

fn mapped(wall_m: f32, lower_edge_m: f32) -> Mapper {
    let (depth, intrinsics) = wall_at(wall_m, lower_edge_m);
    let mut mapper = Mapper::new(GridGeometry::centred(16.0, 0.05), MapperConfig::default());
    for _ in 0..2 {
        assert_eq!(mapper.integrate(&depth, &intrinsics, &World::t_base_camera(), &LEVEL), Integrated::Seen);
    }
    mapper
}

fn cell(mapper: &Mapper, x_m: f64, y_m: f64) -> Cell {
    let map = mapper.map();
    let (c, r) = map.geometry.cell_at(x_m, y_m).unwrap();
    map.at(c, r)
}

#[test]
fn a_wall_is_drawn_where_it_stands_and_nothing_behind_it() {
    let mapper = mapped(3.0, 0.0);
    for y in [-3.02, -1.02, 0.02, 1.02, 3.02] {
        let occupied: Vec<f64> =
            (0..120).map(|i| (f64::from(i) + 0.5) * 0.05).filter(|x| cell(&mapper, *x, y) == Cell::Occupied).collect();
        assert!(!occupied.is_empty() && occupied.iter().all(|x| (x - 3.0).abs() < 0.11), "y {y}: {occupied:?}");
        assert_eq!(cell(&mapper, 2.5, y), Cell::Free);
        assert_eq!(cell(&mapper, 3.6, y), Cell::Unknown);
    }
    assert_eq!(cell(&mapper, -1.0, 0.0), Cell::Unknown, "behind the camera");
}

#[test]
fn what_hangs_above_the_body_is_not_in_its_way() {
    let mapper = mapped(3.0, 1.6);
    assert_eq!(cell(&mapper, 3.0, 0.0), Cell::Free);
    assert_eq!(cell(&mapper, 5.0, 0.0), Cell::Free);
}

#[test]
fn a_frame_without_depth_or_of_another_camera_writes_nothing() {
    let (depth, intrinsics) = wall_at(3.0, 0.0);
    let mut mapper = Mapper::new(GridGeometry::centred(16.0, 0.05), MapperConfig::default());
    let blind = DepthImage::from_metres(160, 120, vec![65.535; 160 * 120]).unwrap();
    let mount = World::t_base_camera();
    assert_eq!(mapper.integrate(&blind, &intrinsics, &mount, &LEVEL), Integrated::Blind);
    let other = Intrinsics::from_hfov(64, 48, 1.0).unwrap();
    assert_eq!(mapper.integrate(&depth, &other, &mount, &LEVEL), Integrated::Blind);
    assert!(mapper.map().cells.iter().all(|c| *c == Cell::Unknown));
    assert!(mapper.known().is_none());
}

#[test]
fn what_the_body_ran_into_outlives_frames_that_look_through_it() {
    let mut mapper = mapped(3.0, 0.0);
    mapper.mark_bump(&LEVEL, 0.23, 0.15);
    let (depth, intrinsics) = wall_at(3.0, 0.0);
    for _ in 0..20 {
        mapper.integrate(&depth, &intrinsics, &World::t_base_camera(), &LEVEL);
    }
    assert_eq!(cell(&mapper, 0.25, 0.0), Cell::Occupied);
    assert!(mapper.forget_bumps() >= 4);
    assert_eq!(cell(&mapper, 0.25, 0.0), Cell::Free);
}

#[test]
fn fast_marching_measures_straight_distances() {
    let g = GridGeometry::centred(12.0, 0.05);
    let mut marcher = Marcher::new(g);
    marcher.march(g.index(120, 120), &everything(&g), Until::Everywhere, |_| 1.0);
    let centre = g.centre(120, 120);
    let (mut sum, mut worst, mut n) = (0.0, 0.0_f64, 0);
    for (c, r) in everything(&g).cells() {
        let (x, y) = g.centre(c, r);
        let exact = ((x - centre.0).powi(2) + (y - centre.1).powi(2)).sqrt();
        if exact > 0.5 {
            let error = (f64::from(marcher.arrival()[g.index(c, r)]) - exact).abs() / exact;
            (sum, worst, n) = (sum + error, worst.max(error), n + 1);
        }
    }
    println!("first order against exact beyond 0.5 m: mean {:.4}, worst {worst:.4}", sum / f64::from(n));
    assert!(sum / f64::from(n) < 0.02 && worst < 0.07);
}

#[test]
fn a_route_leads_around_a_wall_and_keeps_its_distance() {
    let g = GridGeometry::centred(8.0, 0.05);
    let mut map = OccupancyGrid { geometry: g, cells: vec![Cell::Free; g.len()] };
    for (c, r) in everything(&g).cells() {
        let (x, y) = g.centre(c, r);
        if x.abs() < 0.06 && y < 2.0 {
            map.cells[g.index(c, r)] = Cell::Occupied;
        }
    }
    let body = BodyConfig::default();
    let mut terrain = Terrain::new(g, &body, UnknownCells::Closed);
    terrain.survey(&map, everything(&g));
    let mut routes = RoutePlanner::new(&terrain);
    let from = PlanarPose { x_m: -1.0, y_m: 0.0, yaw_rad: 0.0 };
    let route = routes.plan(&map, &terrain, &from, (1.0, 0.0), 0.5).unwrap();
    let nearest =
        route.path_m.iter().map(|p| if p.1 < 2.0 { p.0.abs() } else { p.0.hypot(p.1 - 2.0) }).fold(9.0, f64::min);
    assert!(nearest > body.radius_m, "{nearest}");
    let length: f64 = route.path_m.windows(2).map(|w| (w[0].0 - w[1].0).hypot(w[0].1 - w[1].1)).sum();
    assert!((4.4..6.0).contains(&length), "{length}");
    for (c, r) in everything(&g).cells() {
        if g.centre(c, r).0.abs() < 0.06 {
            map.cells[g.index(c, r)] = Cell::Occupied;
        }
    }
    terrain.survey(&map, everything(&g));
    let no_path = routes.plan(&map, &terrain, &from, (1.0, 0.0), 0.5).unwrap_err();
    assert_eq!(no_path.why, "it is cut off from the robot");
}

fn sure(n_inliers: usize) -> Evidence {
    Evidence { n_inliers, n_off_floor: n_inliers, n_cells: None }
}

fn seen(filter: &GoalFilter, from: PlanarPose, goal: PlanarPose, n_inliers: usize) -> Measurement {
    let (a, b): (Transform<Odom, Base>, Transform<Odom, Base>) = (from.to_transform(), goal.to_transform());
    let mount = World::t_base_camera();
    let camera_goal = mount.inverse() * (a.inverse() * b) * mount;
    let t_camera_goal: Transform<Camera, Goal> = Transform::new(*camera_goal.isometry());
    filter.measure(Stamp(1), &a, &mount, &t_camera_goal, &(Matrix6::identity() * 1e-4), sure(n_inliers)).unwrap()
}

#[test]
fn estimates_that_agree_are_fused_and_one_that_lies_is_outvoted() {
    let mut filter = GoalFilter::new(FilterConfig::default());
    let goal = PlanarPose { x_m: 3.0, y_m: 1.0, yaw_rad: 3.1 };
    let lie = PlanarPose { x_m: 1.0, y_m: -1.0, yaw_rad: 0.0 };
    assert_eq!(filter.join(&seen(&filter, LEVEL, lie, 40), 1), Joined::Opened);
    for i in 0..4_i32 {
        let from = PlanarPose { x_m: 0.2 * f64::from(i), ..LEVEL };
        let off = 0.04 * f64::from(i % 2 * 2 - 1);
        let near = PlanarPose { x_m: goal.x_m + off, yaw_rad: wrap_angle(goal.yaw_rad + off), ..goal };
        filter.join(&seen(&filter, from, near, 30), 2);
    }
    let best = filter.best(2).unwrap();
    assert_eq!((best.n_fused, filter.hypotheses().len()), (4, 2));
    assert!(best.pose.distance_to(goal.x_m, goal.y_m) < 0.05);
    assert!(wrap_angle(best.pose.yaw_rad - goal.yaw_rad).abs() < 0.05, "across the cut at pi: {}", best.pose.yaw_rad);
}

#[test]
fn a_place_that_lied_is_believed_again_only_on_much_better_evidence() {
    let mut filter = GoalFilter::new(FilterConfig::default());
    let place = PlanarPose { x_m: 0.4, y_m: 0.0, yaw_rad: 0.0 };
    filter.join(&seen(&filter, LEVEL, place, 40), 1);
    let doubts = (0..4).map(|_| filter.doubt(&LEVEL, Sightline::Clear, 15.0, 1)).collect::<Vec<_>>();
    assert_eq!(doubts.last(), Some(&Doubt::Refuted));
    filter.condemn(1);
    assert!(filter.best(1).is_none());
    assert_eq!(filter.join(&seen(&filter, LEVEL, place, 50), 2), Joined::Refused);
    assert_eq!(filter.join(&seen(&filter, LEVEL, place, 90), 3), Joined::Opened);
}

#[test]
fn turning_where_a_goal_was_seen_refutes_nothing_and_driving_on_without_it_does() {
    let mut filter = GoalFilter::new(FilterConfig::default());
    let place = PlanarPose { x_m: 2.4, y_m: 0.0, yaw_rad: 0.0 };
    filter.join(&seen(&filter, LEVEL, place, 20), 1);
    let mut doubt = |x_m| filter.doubt(&PlanarPose { x_m, ..LEVEL }, Sightline::Clear, 15.0, 1);
    assert!((0..9).all(|_| doubt(0.0) == Doubt::None), "it was seen from there");
    let driving_on: Vec<Doubt> = (1..=4).flat_map(|i| [0.3 * f64::from(i); 2]).map(&mut doubt).collect();
    assert_eq!(driving_on.iter().position(|d| *d == Doubt::Refuted), Some(6), "four places, one miss each");
}

#[test]
fn a_crowd_of_matches_confirms_a_place_that_was_approached_and_no_other() {
    let place = PlanarPose { x_m: 2.4, y_m: 0.0, yaw_rad: 0.0 };
    let crowded = |filter: &GoalFilter, x_m: f64, n_off_floor: usize| {
        let seen = seen(filter, PlanarPose { x_m, ..LEVEL }, place, 20);
        Measurement { evidence: Evidence { n_inliers: 20, n_off_floor, n_cells: Some(5) }, ..seen }
    };
    let mut filter = GoalFilter::new(FilterConfig::default());
    filter.join(&seen(&filter, LEVEL, place, 20), 1);
    assert_eq!(filter.join(&crowded(&filter, 2.3, 400), 2), Joined::Faint, "it was seen once");
    for x_m in [0.3, 0.6, 0.9, 1.2] {
        assert_eq!(filter.join(&seen(&filter, PlanarPose { x_m, ..LEVEL }, place, 20), 3), Joined::Fused);
    }
    assert_eq!(filter.join(&crowded(&filter, 2.3, 60), 4), Joined::Faint, "a few matches are no crowd");
    assert_eq!(filter.join(&crowded(&filter, 2.3, 400), 5), Joined::Fused);
}

#[test]
fn hypotheses_are_bounded() {
    let mut filter = GoalFilter::new(FilterConfig::default());
    for i in 0..40_i32 {
        let place = PlanarPose { x_m: f64::from(i), y_m: 2.0, yaw_rad: 0.0 };
        filter.join(&seen(&filter, LEVEL, place, 20 + i as usize), 1);
    }
    assert!(filter.hypotheses().len() <= 8);
    assert!(
        filter
            .measure(
                Stamp(0),
                &LEVEL.to_transform(),
                &World::t_base_camera(),
                &Transform::from_rotation(&nalgebra::Matrix3::identity(), Vector3::new(f64::NAN, 0.0, 0.0)),
                &Matrix6::identity(),
                sure(10)
            )
            .is_none()
    );
}

#[test]
fn many_matches_on_a_small_patch_do_not_make_an_arrival() {
    let mut filter = GoalFilter::new(FilterConfig::default());
    let here = PlanarPose { x_m: 0.1, y_m: 0.0, yaw_rad: 0.0 };
    let mut patch = seen(&filter, LEVEL, here, 200);
    patch.evidence.n_cells = Some(5);
    assert_eq!(filter.join(&patch, 1), Joined::Weak, "at the goal the whole view should match");
    let mut far = seen(&filter, LEVEL, PlanarPose { x_m: 2.5, ..LEVEL }, 20);
    far.evidence.n_cells = Some(5);
    assert_eq!(filter.join(&far, 2), Joined::Opened, "from afar a patch is all there is");
}
