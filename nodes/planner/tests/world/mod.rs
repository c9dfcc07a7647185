//! A small flat-world simulator for the planner's tests: rooms with doors and furniture, a depth camera, an imperfect body
//! and an imperfect perception. Everything follows from a seed.
#![allow(
    dead_code,
    clippy::unwrap_used,
    clippy::expect_used,
    clippy::panic,
    reason = "shared by several test binaries"
)]

use std::sync::Arc;

use homing_core::*;
use homing_planner::{Marcher, Mission, Perception, Planner, PlannerObservation, StepEvent, Until, Window};
use nalgebra::{Matrix3, Matrix6, Vector3};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

pub const RADIUS_M: f64 = 0.18;
const CAMERA_M: f64 = 1.25;
const CELL_M: f64 = 0.05;
const WALL_M: f32 = 2.5;

/// How well the world's perception and body behave.
#[derive(Clone, Copy, Debug)]
pub struct Faults {
    pub dropout: f64,
    pub false_positive: f64,
    pub odometry: f64,
}

pub const USUAL: Faults = Faults { dropout: 0.2, false_positive: 0.01, odometry: 1.0 };

pub struct World {
    pub grid: GridGeometry,
    /// Height of what stands in each cell, metres.
    heights: Vec<f32>,
    pub start: PlanarPose,
    pub goal: PlanarPose,
    pub shortest_m: f64,
    pub pose: PlanarPose,
    odometry: PlanarPose,
    rng: ChaCha8Rng,
    pub clock: Stamp,
    pub faults: Faults,
    pub image: (u32, u32),
    pub path_m: f64,
}

impl World {
    /// A flat of `columns` x `rows` rooms; start and goal are `between_m` apart on foot.
    pub fn flat(seed: u64, between_m: (f64, f64), faults: Faults) -> Self {
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        loop {
            let (columns, rows) = (rng.random_range(2..=4), rng.random_range(2..=3));
            let (grid, heights) = build(&mut rng, columns, rows);
            let mut world = World {
                grid,
                heights,
                start: PlanarPose::default(),
                goal: PlanarPose::default(),
                shortest_m: 0.0,
                pose: PlanarPose::default(),
                odometry: PlanarPose::default(),
                rng: ChaCha8Rng::seed_from_u64(seed ^ 0x5eed),
                clock: Stamp(1_000_000_000),
                faults,
                image: (128, 96),
                path_m: 0.0,
            };
            for _ in 0..40 {
                let (start, goal) = (world.free_pose(&mut rng), world.free_pose(&mut rng));
                let shortest = world.geodesic((start.x_m, start.y_m), (goal.x_m, goal.y_m));
                if shortest >= between_m.0 && shortest <= between_m.1 {
                    (world.start, world.goal, world.pose, world.shortest_m) = (start, goal, start, shortest);
                    return world;
                }
            }
        }
    }

    fn free_pose(&self, rng: &mut ChaCha8Rng) -> PlanarPose {
        loop {
            let x_m = rng.random_range(0.0..self.grid.width as f64 * CELL_M);
            let y_m = rng.random_range(0.0..self.grid.height as f64 * CELL_M);
            let yaw_rad = rng.random_range(-3.1..3.1);
            if self.fits(x_m, y_m, RADIUS_M + 0.1) {
                return PlanarPose { x_m, y_m, yaw_rad };
            }
        }
    }

    pub fn height(&self, x_m: f64, y_m: f64) -> f32 {
        self.grid.cell_at(x_m, y_m).map_or(WALL_M, |(c, r)| self.heights[self.grid.index(c, r)])
    }

    fn fits(&self, x_m: f64, y_m: f64, radius_m: f64) -> bool {
        Window::around(&self.grid, (x_m, y_m), radius_m + CELL_M).cells().all(|(c, r)| {
            let (cx, cy) = self.grid.centre(c, r);
            let (dx, dy) = (((cx - x_m).abs() - 0.5 * CELL_M).max(0.0), ((cy - y_m).abs() - 0.5 * CELL_M).max(0.0));
            self.heights[self.grid.index(c, r)] == 0.0 || dx * dx + dy * dy > radius_m * radius_m
        }) && self.height(x_m, y_m) == 0.0
    }

    /// Shortest way on foot for the body, metres.
    pub fn geodesic(&self, from: (f64, f64), to: (f64, f64)) -> f64 {
        let mut marcher = Marcher::new(self.grid);
        let (c, r) = self.grid.cell_at(to.0, to.1).unwrap();
        let all = Window { column_min: 1, column_max: self.grid.width - 1, row_min: 1, row_max: self.grid.height - 1 };
        marcher.march(self.grid.index(c, r), &all, Until::Everywhere, |i| {
            let (x, y) = self.grid.centre(i % self.grid.width, i / self.grid.width);
            if self.fits(x, y, RADIUS_M - 0.02) { 1.0 } else { f32::INFINITY }
        });
        f64::from(marcher.at(from.0, from.1))
    }

    fn sees(&self, from: &PlanarPose, to: &PlanarPose) -> bool {
        let away = from.distance_to(to.x_m, to.y_m);
        let n = (away / 0.03).ceil().max(1.0) as usize;
        (0..=n).all(|i| {
            let s = i as f64 / n as f64;
            self.height(from.x_m + s * (to.x_m - from.x_m), from.y_m + s * (to.y_m - from.y_m)) < CAMERA_M as f32
        })
    }

    /// The depth image at the true pose, drawn front to back column by column.
    pub fn depth(&self, intrinsics: &Intrinsics) -> DepthImage {
        let (width, height) = (intrinsics.width() as usize, intrinsics.height() as usize);
        let mut data = vec![0.0_f32; width * height];
        for column in 0..width {
            let across = (column as f64 - intrinsics.cx()) / intrinsics.fx();
            let heading = self.pose.yaw_rad - libm::atan(across);
            let (sin, cos) = (libm::sin(heading), libm::cos(heading));
            let stretch = (1.0 + across * across).sqrt();
            let mut row = height as i64 - 1;
            let mut z = 0.05;
            while z < 10.0 && row >= 0 {
                let reach = z * stretch;
                let top = f64::from(self.height(self.pose.x_m + reach * cos, self.pose.y_m + reach * sin));
                while row >= 0 {
                    let slope = (intrinsics.cy() - row as f64) / intrinsics.fy();
                    let at = CAMERA_M + slope * z;
                    if at > top {
                        break;
                    }
                    let depth = if top == 0.0 { CAMERA_M / -slope } else { z };
                    data[row as usize * width + column] = depth as f32;
                    row -= 1;
                }
                z += 0.03;
            }
        }
        DepthImage::from_metres(width as u32, height as u32, data).unwrap()
    }

    pub fn intrinsics(&self) -> Intrinsics {
        Intrinsics::from_hfov(self.image.0, self.image.1, 120_f64.to_radians()).unwrap()
    }

    pub fn t_base_camera() -> Transform<Base, Camera> {
        let r = Matrix3::new(0.0, 0.0, 1.0, -1.0, 0.0, 0.0, 0.0, -1.0, 0.0);
        Transform::from_rotation(&r, Vector3::new(0.0, 0.0, CAMERA_M))
    }

    pub fn observe(&mut self) -> PlannerObservation {
        let intrinsics = self.intrinsics();
        PlannerObservation {
            odometry: Odometry {
                stamp: self.clock,
                t_odom_base: self.odometry.to_transform(),
                linear_m_s: 0.0,
                angular_rad_s: 0.0,
            },
            depth: Arc::new(self.depth(&intrinsics)),
            intrinsics,
            t_base_camera: Self::t_base_camera(),
        }
    }

    fn noise(&mut self, sd: f64) -> f64 {
        // Twelve uniforms make a normal well enough here.
        let sum: f64 = (0..12).map(|_| self.rng.random_range(0.0..1.0)).sum();
        (sum - 6.0) * sd
    }

    pub fn perceive(&mut self) -> GoalEstimate {
        let range = self.pose.distance_to(self.goal.x_m, self.goal.y_m);
        let turn = wrap_angle(self.goal.yaw_rad - self.pose.yaw_rad).abs();
        let visible = range < 3.5 && turn < 45_f64.to_radians() && self.sees(&self.pose.clone(), &self.goal.clone());
        let (drop, lie) = (self.rng.random_bool(self.faults.dropout), self.rng.random_bool(self.faults.false_positive));
        let sighting = if lie {
            let (x, y) = (self.rng.random_range(0.5..3.5), self.rng.random_range(-2.0..2.0));
            let yaw = self.rng.random_range(-1.0..1.0);
            let n = self.rng.random_range(10..45);
            self.sighting(PlanarPose { x_m: x, y_m: y, yaw_rad: yaw }, n)
        } else if visible && !drop {
            let sd = 0.02 + 0.02 * range;
            let t: Transform<Base, Base> = {
                let a: Transform<Odom, Base> = self.pose.to_transform();
                let b: Transform<Odom, Base> = self.goal.to_transform();
                a.inverse() * b
            };
            let mut relative = t.planar();
            relative.x_m += self.noise(sd);
            relative.y_m += self.noise(sd);
            relative.yaw_rad += self.noise(0.03);
            let n = (130.0 * libm::exp(-0.35 * range) * libm::cos(turn)) as usize + 5;
            self.sighting(relative, n)
        } else {
            Sighting::NotSeen { reason: UnseenReason::TooFewMatches }
        };
        GoalEstimate {
            stamp: self.clock,
            goal_id: 7,
            sighting,
            switch_probability: None,
            n_matches: 100,
            matched_points: Vec::new(),
            times: StageTimes::default(),
        }
    }

    fn sighting(&self, relative: PlanarPose, n_inliers: usize) -> Sighting {
        let t_base_goalbase: Transform<Base, Base> = relative.to_transform();
        let t_base_camera = Self::t_base_camera();
        let t = t_base_camera.inverse() * t_base_goalbase * t_base_camera;
        Sighting::Pose {
            t_camera_goal: Transform::new(*t.isometry()),
            covariance: Matrix6::identity() * 0.001,
            n_inliers,
            rms_rad: 0.005,
        }
    }

    /// Moves the body, without sliding, and gives what odometry says about it.
    pub fn apply(&mut self, action: Action) -> MotionOutcome {
        let before = self.pose;
        let mut blocked = false;
        match action {
            Action::Forward => {
                for _ in 0..25 {
                    let x = self.pose.x_m + 0.01 * libm::cos(self.pose.yaw_rad);
                    let y = self.pose.y_m + 0.01 * libm::sin(self.pose.yaw_rad);
                    if !self.fits(x, y, RADIUS_M) {
                        blocked = true;
                        break;
                    }
                    (self.pose.x_m, self.pose.y_m) = (x, y);
                }
            }
            Action::TurnLeft | Action::TurnRight => {
                let sign = if action == Action::TurnLeft { 1.0 } else { -1.0 };
                let noise = self.noise(0.007 * self.faults.odometry);
                self.pose.yaw_rad = wrap_angle(self.pose.yaw_rad + sign * 15_f64.to_radians() + noise);
            }
            Action::Face { milliradians } => {
                let noise = self.noise(0.007 * self.faults.odometry);
                self.pose.yaw_rad = wrap_angle(self.pose.yaw_rad + 1e-3 * f64::from(milliradians) + noise);
            }
            Action::Stop | Action::Hold => {}
        }
        self.path_m += before.distance_to(self.pose.x_m, self.pose.y_m);
        self.clock = Stamp(self.clock.0 + 200_000_000);
        let (a, b): (Transform<Odom, Base>, Transform<Odom, Base>) = (before.to_transform(), self.pose.to_transform());
        let mut moved = (a.inverse() * b).planar_of_base();
        if !matches!(action, Action::Stop | Action::Hold) {
            moved.x_m += self.noise(0.002 * self.faults.odometry);
            moved.y_m += self.noise(0.001 * self.faults.odometry);
            moved.yaw_rad += self.noise(0.0015 * self.faults.odometry);
        }
        let odometry: Transform<Odom, Base> = self.odometry.to_transform();
        let step: Transform<Base, Base> = moved.to_transform();
        self.odometry = (odometry * step).planar();
        MotionOutcome { stamp: self.clock, moved, blocked }
    }
}

trait PlanarOfBase {
    fn planar_of_base(&self) -> PlanarPose;
}

impl PlanarOfBase for Transform<Base, Base> {
    fn planar_of_base(&self) -> PlanarPose {
        self.planar()
    }
}

fn build(rng: &mut ChaCha8Rng, columns: usize, rows: usize) -> (GridGeometry, Vec<f32>) {
    let widths: Vec<f64> = (0..columns).map(|_| rng.random_range(3.0..4.6)).collect();
    let depths: Vec<f64> = (0..rows).map(|_| rng.random_range(3.0..4.6)).collect();
    let edge = |sizes: &[f64], i: usize| 0.3 + sizes[..i].iter().sum::<f64>();
    let (width_m, depth_m) = (edge(&widths, columns) + 0.3, edge(&depths, rows) + 0.3);
    let grid = GridGeometry {
        width: (width_m / CELL_M).ceil() as usize,
        height: (depth_m / CELL_M).ceil() as usize,
        resolution_m: CELL_M,
        origin_x_m: 0.0,
        origin_y_m: 0.0,
    };
    let mut heights = vec![0.0; grid.len()];
    let mut fill = |x0: f64, y0: f64, x1: f64, y1: f64, height: f32| {
        let middle = ((x0 + x1) / 2.0, (y0 + y1) / 2.0);
        for (c, r) in Window::around(&grid, middle, ((x1 - x0) / 2.0).max((y1 - y0) / 2.0) + 0.1).cells() {
            let (x, y) = grid.centre(c, r);
            if x >= x0 && x <= x1 && y >= y0 && y <= y1 {
                heights[grid.index(c, r)] = height;
            }
        }
    };
    for c in 0..=columns {
        let x = edge(&widths, c);
        fill(x - 0.06, 0.2, x + 0.06, depth_m - 0.2, WALL_M);
    }
    for r in 0..=rows {
        let y = edge(&depths, r);
        fill(0.2, y - 0.06, width_m - 0.2, y + 0.06, WALL_M);
    }
    // Furniture keeps to the rooms' corners, so that doors in the middle third stay open.
    for c in 0..columns {
        for r in 0..rows {
            for (right, top) in [(false, false), (true, false), (false, true), (true, true)] {
                if rng.random_bool(0.55) {
                    let (w, d) = (rng.random_range(0.4..0.9), rng.random_range(0.4..0.9));
                    let height = [0.45, 0.75, 1.9][rng.random_range(0..3)];
                    let x = if right { edge(&widths, c + 1) - w } else { edge(&widths, c) };
                    let y = if top { edge(&depths, r + 1) - d } else { edge(&depths, r) };
                    fill(x, y, x + w, y + d, height);
                }
            }
            if rng.random_bool(0.3) {
                let (x, y) = (edge(&widths, c) + 0.5 * widths[c], edge(&depths, r) + 0.5 * depths[r]);
                fill(x - 0.35, y - 0.25, x + 0.35, y + 0.25, 0.75);
            }
        }
    }
    // Every room is joined to an earlier one; some walls get a second door.
    for c in 0..columns {
        for r in 0..rows {
            let west = c > 0 && (r == 0 || rng.random_bool(0.6));
            let south = r > 0 && (!west || rng.random_bool(0.4));
            let door = 0.45;
            if west {
                let (x, y) = (edge(&widths, c), edge(&depths, r) + depths[r] * rng.random_range(0.42..0.58));
                fill(x - 0.08, y - door, x + 0.08, y + door, 0.0);
            }
            if south {
                let (x, y) = (edge(&widths, c) + widths[c] * rng.random_range(0.42..0.58), edge(&depths, r));
                fill(x - door, y - 0.08, x + door, y + 0.08, 0.0);
            }
        }
    }
    (grid, heights)
}

/// How an episode ended.
#[derive(Clone, Debug)]
pub struct Outcome {
    pub success: bool,
    pub stopped: bool,
    pub steps: u64,
    pub path_m: f64,
    pub shortest_m: f64,
    pub final_m: f64,
    pub final_rad: f64,
    pub mode: Mode,
    pub actions: Vec<Action>,
    pub worst_ms: f64,
    pub total_ms: f64,
    pub reason: String,
}

impl Outcome {
    pub fn spl(&self) -> f64 {
        if self.success { self.shortest_m / self.path_m.max(self.shortest_m) } else { 0.0 }
    }
}

/// CPU time of this thread so far, milliseconds: what a step costs whatever else the machine does.
pub fn cpu_ms() -> f64 {
    let text = std::fs::read_to_string("/proc/thread-self/schedstat").unwrap_or_default();
    text.split_whitespace().next().and_then(|ns| ns.parse::<f64>().ok()).unwrap_or(0.0) * 1e-6
}

/// Runs an episode in lockstep until the planner stops, gives up, or 500 steps are over.
pub fn run(world: &mut World, planner: &mut Planner, mut watch: impl FnMut(&World, &Planner)) -> Outcome {
    let mut event = StepEvent::nothing();
    event.mission = Some(Mission::Start { goal_id: 7 });
    event.perception = Perception::Present;
    let (mut actions, mut worst_ms, mut total_ms) = (Vec::new(), 0.0_f64, 0.0);
    let mut stopped = false;
    for _ in 0..500 {
        event.observation = Some(world.observe());
        event.estimate = Some(world.perceive());
        let begun = cpu_ms();
        let action = planner.step(world.clock, &event);
        let ms = cpu_ms() - begun;
        worst_ms = worst_ms.max(ms);
        total_ms += ms;
        actions.push(action);
        watch(world, planner);
        event.mission = None;
        if action == Action::Stop || planner.state().mode == Mode::Failed {
            stopped = action == Action::Stop;
            break;
        }
        event.motion = Some(world.apply(action));
    }
    let final_m = world.geodesic((world.pose.x_m, world.pose.y_m), (world.goal.x_m, world.goal.y_m));
    Outcome {
        success: stopped && final_m <= 1.0,
        stopped,
        steps: actions.len() as u64,
        path_m: world.path_m,
        shortest_m: world.shortest_m,
        final_m: world.pose.distance_to(world.goal.x_m, world.goal.y_m),
        final_rad: wrap_angle(world.pose.yaw_rad - world.goal.yaw_rad).abs(),
        mode: planner.state().mode,
        actions,
        worst_ms,
        total_ms,
        reason: planner.state().reason.clone(),
    }
}
