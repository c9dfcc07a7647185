//! A simulated robot behind the same seam as a real one.

use core::time::Duration;
use std::sync::Arc;

use homing_core::{
    Base, BridgeError, Capabilities, Intrinsics, IntrinsicsError, Motion, MotionOutcome, Observation, Odom, Odometry,
    PlanarPose, Resettable, RgbdFrame, RobotBridge, Stamp, Transform,
};

use crate::arena::Arena;
use crate::body::{Body, Sliding, Travel};
use crate::constants::{FORWARD_M, TURN_RAD};
use crate::episode::{Episode, FloorPose, Viewpoint, t_world_base};
use crate::laser::LaserConfig;
use crate::noise::{Command, Distortion, Noise, NoiseConfig};
use crate::scene::World;
use crate::score::{Ending, Finish, Score};

/// Longest single motion, seconds: whatever is asked for beyond it is cut off.
const MOTION_S_MAX: f64 = 10.0;

/// What the simulated robot is like. Its size is the arena's.
#[derive(Copy, Clone, Debug, PartialEq)]
pub struct SimConfig {
    /// Its camera.
    pub camera: Viewpoint,
    /// Fastest forward speed, m/s; one step forward takes `FORWARD_M` of it.
    pub linear_m_s_max: f64,
    /// Fastest turn, rad/s.
    pub angular_rad_s_max: f64,
    /// How long a velocity lasts that is applied as one motion, seconds.
    pub velocity_s: f64,
    /// What happens at an obstacle.
    pub sliding: Sliding,
    /// Its scanner, if it has one.
    pub laser: Option<LaserConfig>,
    /// What is noisy. The scanner is not.
    pub noise: NoiseConfig,
}

impl Default for SimConfig {
    /// 0.5 m/s and 30 degrees/s: a step and a turn take half a second each.
    fn default() -> Self {
        Self {
            camera: Viewpoint::default(),
            linear_m_s_max: FORWARD_M / 0.5,
            angular_rad_s_max: TURN_RAD / 0.5,
            velocity_s: 0.1,
            sliding: Sliding::Off,
            laser: Some(LaserConfig::default()),
            noise: NoiseConfig::default(),
        }
    }
}

/// A robot in an arena. Its odometry is exact unless it is made noisy; time is simulated and advances with motions only.
#[derive(Debug)]
pub struct Simulator {
    arena: Arc<Arena>,
    config: SimConfig,
    capabilities: Capabilities,
    intrinsics: Intrinsics,
    t_world_odom: Transform<World, Odom>,
    body: Body,
    now: Stamp,
    speed: (f64, f64),
    noise: Noise,
    /// Rate of the motion that just ended, radians a second: what a shutter sees of it.
    turn_rad_s: f64,
    path_m: f64,
    steps: u64,
    collisions: u64,
    stopped: bool,
    seen: Option<Observation>,
}

impl Simulator {
    /// A robot in the middle of an arena, wherever that is; [`Resettable::reset`] puts it at a start.
    ///
    /// # Errors
    /// [`IntrinsicsError`] for a camera that cannot be.
    pub fn new(arena: Arc<Arena>, config: SimConfig) -> Result<Self, IntrinsicsError> {
        let intrinsics = config.camera.intrinsics()?;
        let size = arena.size();
        let capabilities = Capabilities {
            name: format!("simulator ({})", arena.scene().name),
            drivable: true,
            has_scan: config.laser.is_some(),
            intrinsics,
            t_base_camera: config.camera.t_base_camera(),
            radius_m: size.radius_m,
            height_m: size.height_m,
            linear_m_s_max: config.linear_m_s_max,
            angular_rad_s_max: config.angular_rad_s_max,
        };
        let (x_m, y_m) = arena.space().nth(arena.space().len() / 2).unwrap_or_default();
        let body =
            Body { pose: PlanarPose { x_m, y_m, yaw_rad: 0.0 }, radius_m: size.radius_m, sliding: config.sliding };
        let t_world_odom = Transform::new(*t_world_base(&arena, body.pose).isometry());
        Ok(Self {
            arena,
            config,
            capabilities,
            intrinsics,
            t_world_odom,
            body,
            now: Stamp(0),
            speed: (0.0, 0.0),
            noise: Noise::new(config.noise),
            turn_rad_s: 0.0,
            path_m: 0.0,
            steps: 0,
            collisions: 0,
            stopped: false,
            seen: None,
        })
    }

    /// Drives for a while with velocities cut to the robot's limits, for drivers that keep time themselves. Forward
    /// speed in m/s, turning speed in rad/s.
    ///
    /// # Errors
    /// [`BridgeError::NotFinite`] for velocities that are not numbers.
    pub fn step_velocity(
        &mut self,
        linear_m_s: f64,
        angular_rad_s: f64,
        duration: Duration,
    ) -> Result<MotionOutcome, BridgeError> {
        let motion = Motion::Velocity { linear_m_s, angular_rad_s };
        if !motion.is_finite() {
            return Err(BridgeError::NotFinite { motion });
        }
        let (v_max, w_max) = (self.config.linear_m_s_max, self.config.angular_rad_s_max);
        let speed = (linear_m_s.clamp(-v_max, v_max), angular_rad_s.clamp(-w_max, w_max));
        let duration_s = duration.as_secs_f64();
        let command = Command::Velocity { distance_m: speed.0 * duration_s, angle_rad: speed.1 * duration_s };
        let outcome = match self.noise.motion.actuate(command) {
            None => {
                self.moving(command, duration_s, |body, arena| body.drive(arena.grid(), speed.0, speed.1, duration_s))
            }
            Some(by) => self.moving(command, duration_s, |body, arena| {
                let travel = body.drive(arena.grid(), by.x_m / duration_s, by.yaw_rad / duration_s, duration_s);
                // Wheels do not drive aside: what slips is no way made, and no collision.
                body.displace(arena.grid(), &PlanarPose { x_m: 0.0, y_m: by.y_m, yaw_rad: 0.0 });
                travel
            }),
        };
        self.speed = if outcome.blocked { (0.0, speed.1) } else { speed };
        Ok(outcome)
    }

    /// Where the robot believes it is, without looking.
    #[must_use]
    pub fn odometry(&self) -> Odometry {
        Odometry {
            stamp: self.now,
            t_odom_base: self.t_odom_base(),
            linear_m_s: self.speed.0,
            angular_rad_s: self.speed.1,
        }
    }

    /// Gives noisy depth the distortion of a real camera.
    pub fn set_depth_distortion(&mut self, distortion: Arc<Distortion>) {
        self.noise.set_distortion(distortion);
        self.seen = None;
    }

    /// The simulated time.
    #[must_use]
    pub fn now(&self) -> Stamp {
        self.now
    }

    /// The arena it drives in. Ground truth: for drivers and scorers, never for perception or planner.
    #[must_use]
    pub fn arena(&self) -> &Arc<Arena> {
        &self.arena
    }

    /// Where the robot really is, world frame. Ground truth.
    #[must_use]
    pub fn pose_truth(&self) -> PlanarPose {
        self.body.pose
    }

    /// The body as it stands. Ground truth.
    #[must_use]
    pub fn body_truth(&self) -> &Body {
        &self.body
    }

    /// The start pose in the world frame. Ground truth.
    #[must_use]
    pub fn t_world_odom_truth(&self) -> Transform<World, Odom> {
        self.t_world_odom
    }

    /// Length of the way really made since the reset, metres. Ground truth.
    #[must_use]
    pub fn path_length_m_truth(&self) -> f64 {
        self.path_m
    }

    /// Motions applied since the reset, the stop included.
    #[must_use]
    pub fn steps(&self) -> u64 {
        self.steps
    }

    /// Puts the robot somewhere else, as only an oracle can; `way_m` counts as driven. World frame.
    pub fn teleport(&mut self, pose: PlanarPose, way_m: f64) {
        self.moving(Command::Stand, self.config.velocity_s, |body, _| {
            body.pose = pose;
            Travel { path_m: way_m, blocked: false }
        });
    }

    /// How it stands with the robot; `last_mile_steps` only the planner knows. Ground truth.
    #[must_use]
    pub fn ending_truth(&self, last_mile_steps: u64) -> Ending {
        Ending {
            stopped: self.stopped,
            steps: self.steps,
            last_mile_steps,
            path_length_m: self.path_m,
            collisions: self.collisions,
            pose: self.body.pose,
        }
    }

    /// The strict score of the episode as it stands. Ground truth.
    #[must_use]
    pub fn score_truth(&self, episode: &Episode) -> Score {
        Score::strict(&Finish::new(&self.arena, episode, &self.ending_truth(0)))
    }

    /// Where the robot really is in the odometry frame, metres and radians. Ground truth.
    #[must_use]
    pub fn t_odom_base_truth(&self) -> Transform<Odom, Base> {
        self.t_world_odom.inverse() * t_world_base(&self.arena, self.body.pose)
    }

    /// Where the odometry believes the robot to be.
    fn t_odom_base(&self) -> Transform<Odom, Base> {
        self.noise.motion.believed().map_or_else(|| self.t_odom_base_truth(), PlanarPose::to_transform)
    }

    /// Lets the body move, its odometry notice, and time pass.
    fn moving(
        &mut self,
        command: Command,
        duration_s: f64,
        motion: impl FnOnce(&mut Body, &Arena) -> Travel,
    ) -> MotionOutcome {
        let (before, before_truth) = (self.t_odom_base(), self.t_odom_base_truth());
        let travel = motion(&mut self.body, &self.arena);
        self.path_m += travel.path_m;
        self.collisions += u64::from(travel.blocked);
        self.now = self.now.after(Duration::from_nanos((duration_s.max(0.0) * 1e9).round() as u64));
        self.seen = None;
        let made = (before_truth.inverse() * self.t_odom_base_truth()).planar();
        self.turn_rad_s = if duration_s > 0.0 { made.yaw_rad / duration_s } else { 0.0 };
        self.noise.motion.sense(command, &before_truth.planar(), &made);
        let moved = (before.inverse() * self.t_odom_base()).planar();
        MotionOutcome { stamp: self.now, moved, blocked: travel.blocked }
    }

    fn look(&self) -> Result<Observation, BridgeError> {
        let t_world_camera = t_world_base(&self.arena, self.body.pose) * self.capabilities.t_base_camera;
        let device = |what: String| BridgeError::Device { name: self.capabilities.name.clone(), what };
        let clean = self.arena.view(&self.intrinsics, &t_world_camera);
        let noisy = self.noise.images(clean, &self.intrinsics, self.turn_rad_s, self.now);
        let (rgb, depth) = noisy.map_err(|e| device(e.to_string()))?;
        let frame = RgbdFrame::new(self.now, Arc::new(rgb), Arc::new(depth), self.intrinsics)
            .map_err(|e| device(e.to_string()))?;
        let scan = self.config.laser.map(|laser| self.arena.laser().scan(&self.body.pose, &laser, self.now));
        Ok(Observation { frame, odometry: self.odometry(), scan })
    }
}

impl RobotBridge for Simulator {
    fn capabilities(&self) -> &Capabilities {
        &self.capabilities
    }

    fn observe(&mut self) -> Result<Observation, BridgeError> {
        if let Some(seen) = &self.seen {
            return Ok(seen.clone());
        }
        let observation = self.look()?;
        self.seen = Some(observation.clone());
        Ok(observation)
    }

    fn apply(&mut self, motion: Motion) -> Result<MotionOutcome, BridgeError> {
        if !motion.is_finite() {
            return Err(BridgeError::NotFinite { motion });
        }
        self.steps += 1;
        let (v_max, w_max) = (self.config.linear_m_s_max, self.config.angular_rad_s_max);
        let outcome = match motion {
            Motion::Velocity { linear_m_s, angular_rad_s } => {
                return self.step_velocity(linear_m_s, angular_rad_s, Duration::from_secs_f64(self.config.velocity_s));
            }
            Motion::Forward { distance_m } => {
                let distance_m = distance_m.clamp(-MOTION_S_MAX * v_max, MOTION_S_MAX * v_max);
                let command = Command::Forward { distance_m };
                let slipping = self.noise.motion.actuate(command);
                self.moving(command, distance_m.abs() / v_max, |body, arena| match slipping {
                    None => body.advance(arena.grid(), distance_m),
                    Some(by) => body.displace(arena.grid(), &by),
                })
            }
            Motion::Turn { angle_rad } => {
                let angle_rad = angle_rad.clamp(-MOTION_S_MAX * w_max, MOTION_S_MAX * w_max);
                let command = Command::Turn { angle_rad };
                let slipping = self.noise.motion.actuate(command);
                self.moving(command, angle_rad.abs() / w_max, |body, arena| {
                    match slipping {
                        None => body.turn(angle_rad),
                        // A slip in place is no way made, and where it ends at something no collision.
                        Some(by) => _ = body.displace(arena.grid(), &by),
                    }
                    Travel { path_m: 0.0, blocked: false }
                })
            }
            Motion::Stop { done } => {
                self.stopped = self.stopped || done;
                // Standing takes time too: the next observation has a stamp of its own.
                self.moving(Command::Stand, self.config.velocity_s, |_, _| Travel { path_m: 0.0, blocked: false })
            }
        };
        self.speed = (0.0, 0.0);
        Ok(outcome)
    }

    fn stop(&mut self) {
        if self.speed != (0.0, 0.0) {
            self.speed = (0.0, 0.0);
            self.turn_rad_s = 0.0;
            self.seen = None;
        }
    }
}

impl Resettable for Simulator {
    type Episode = Episode;

    fn reset(&mut self, episode: &Episode) -> Result<(), BridgeError> {
        let FloorPose { x_m, y_m, .. } = episode.start;
        let refuse = |what: String| Err(BridgeError::Device { name: self.capabilities.name.clone(), what });
        if episode.scene != *self.arena.scene_ref() {
            return refuse(format!("the episode belongs to {:?}, not to this scene", episode.scene));
        }
        if !self.arena.space().contains(x_m, y_m) {
            return refuse(format!("the start ({x_m:.2}, {y_m:.2}) is not in the free space"));
        }
        self.body.pose = episode.start.into();
        self.t_world_odom = Transform::new(*t_world_base(&self.arena, self.body.pose).isometry());
        self.now = Stamp(0);
        self.speed = (0.0, 0.0);
        self.turn_rad_s = 0.0;
        self.noise.reset(episode.seed);
        self.path_m = 0.0;
        self.steps = 0;
        self.collisions = 0;
        self.stopped = false;
        self.seen = None;
        Ok(())
    }
}
