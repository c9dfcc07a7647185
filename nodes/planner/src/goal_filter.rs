//! Where the goal is, from many estimates of which some are wrong.
//!
//! SLING predicts once and drives (its limitation 3). Here every estimate counts: those that agree are fused, those that
//! do not open another hypothesis, and a hypothesis that is looked at from near and not confirmed is dropped and its place
//! remembered as one that lied.

use homing_core::{Base, Camera, Goal, Odom, PlanarPose, Stamp, Transform, wrap_angle};
use nalgebra::{Isometry3, Matrix3, Matrix6, Vector3};

use crate::evidence::Evidence;
use crate::hypothesis::Hypothesis;
pub use crate::hypothesis::Measurement;
use crate::ladder::{Climb, LadderConfig, Standing};

/// Squared Mahalanobis distance that 99.9 % of agreeing (x, y, yaw) stay below.
const GATE: f64 = 16.3;
/// What a measurement must cover to support a place that is believed already, as a share of what opens a new one.
const KNOWN_PLACE: f64 = 0.65;
const HYPOTHESES_MAX: usize = 8;
const LIARS_MAX: usize = 16;

/// How estimates are fused.
#[derive(Copy, Clone, Debug, PartialEq)]
pub struct FilterConfig {
    /// Perception's standard deviations are multiplied by this: its matches share one view and one depth error.
    pub inflation: f64,
    /// Smallest standard deviation of position believed, metres.
    pub position_sd_min_m: f64,
    /// And this much more per metre of distance.
    pub position_sd_per_m: f64,
    /// Smallest standard deviation of heading believed, radians.
    pub heading_sd_min_rad: f64,
    /// Odometry drift per step, metres (one standard deviation).
    pub drift_m: f64,
    /// Odometry drift per step, radians (one standard deviation).
    pub drift_rad: f64,
    /// When a hypothesis is confirmed, kept or dropped while approaching.
    pub ladder: LadderConfig,
    /// A hypothesis keeps this share of its support when a view that should have shown the goal did not.
    pub miss_factor: f64,
    /// A place that lied is not believed again within this distance, metres.
    pub liar_m: f64,
    /// Nor within this difference of heading, radians.
    pub liar_rad: f64,
}

impl Default for FilterConfig {
    fn default() -> Self {
        Self {
            inflation: 1.5,
            position_sd_min_m: 0.03,
            position_sd_per_m: 0.03,
            heading_sd_min_rad: 0.03,
            drift_m: 0.005,
            drift_rad: 0.002,
            ladder: LadderConfig::default(),
            miss_factor: 0.65,
            liar_m: 0.6,
            liar_rad: 0.6,
        }
    }
}

/// What became of a measurement.
#[derive(Copy, Clone, Debug, PartialEq, Eq)]
pub enum Joined {
    /// It agreed with a hypothesis.
    Fused,
    /// It opened a new one.
    Opened,
    /// It covers too little of the view for how near the goal should be.
    Weak,
    /// The same, and it names the place that is believed already: it speaks neither for it nor against it.
    Faint,
    /// Its place lied before.
    Refused,
}

/// Whether anything on the map stands between the robot and a place.
#[derive(Copy, Clone, Debug, PartialEq, Eq)]
pub enum Sightline {
    /// Nothing known.
    Clear,
    /// An obstacle.
    Hidden,
}

/// What a view that did not show the goal says about the best hypothesis.
#[derive(Copy, Clone, Debug, PartialEq, Eq)]
pub enum Doubt {
    /// Not enough to drop it.
    None,
    /// It is wrong.
    Refuted,
}

/// A place that perception named and that was not the goal.
#[derive(Copy, Clone, Debug, PartialEq)]
struct Liar {
    pose: PlanarPose,
    n_inliers: usize,
}

/// A bounded set of goal hypotheses.
#[derive(Clone, Debug)]
pub struct GoalFilter {
    config: FilterConfig,
    hypotheses: Vec<Hypothesis>,
    liars: Vec<Liar>,
    rigour: f64,
}

impl GoalFilter {
    /// Empty.
    #[must_use]
    pub fn new(config: FilterConfig) -> Self {
        Self { config, hypotheses: Vec::new(), liars: Vec::new(), rigour: 1.0 }
    }

    /// Forgets everything, liars included.
    pub fn reset(&mut self) {
        self.hypotheses.clear();
        self.liars.clear();
        self.rigour = 1.0;
    }

    /// The same goal is given again: what spoke for a place still does, what spoke against one may have changed.
    pub fn begin_again(&mut self) {
        self.liars.clear();
        self.rigour = 1.0;
        for hypothesis in &mut self.hypotheses {
            (hypothesis.parked_until, hypothesis.last_seen_step) = (0, 0);
            (hypothesis.n_misses, hypothesis.n_missed) = (0, 0);
        }
    }

    /// The knobs.
    #[must_use]
    pub fn config(&self) -> &FilterConfig {
        &self.config
    }

    /// One step of odometry drift.
    pub fn drift(&mut self) {
        let (position, yaw) = (self.config.drift_m.powi(2), self.config.drift_rad.powi(2));
        for hypothesis in &mut self.hypotheses {
            hypothesis.drift(position, yaw);
        }
    }

    /// Widens a measurement by the odometry's drift over the steps since its image was taken.
    pub fn age(&self, measurement: &mut Measurement, n_steps: usize) {
        let n = n_steps as f64;
        let variances = Vector3::new(self.config.drift_m, self.config.drift_m, self.config.drift_rad);
        measurement.covariance += Matrix3::from_diagonal(&variances.map(|sd| n * sd * sd));
    }

    /// The planar goal pose an estimate stands for: the base pose at which the robot's camera coincides with the goal camera,
    /// `T_odom_goalbase = T_odom_base T_base_camera T_camera_goal T_base_camera^-1`, seen from above. A goal camera at
    /// another height or pitch changes nothing else. `None` if a number is not finite or the covariance is not one.
    #[must_use]
    pub fn measure(
        &self,
        stamp: Stamp,
        t_odom_base: &Transform<Odom, Base>,
        t_base_camera: &Transform<Base, Camera>,
        t_camera_goal: &Transform<Camera, Goal>,
        covariance: &Matrix6<f64>,
        evidence: Evidence,
    ) -> Option<Measurement> {
        let chain = t_odom_base.isometry() * t_base_camera.isometry() * t_camera_goal.isometry();
        let t_odom_goalbase: Transform<Odom, Base> =
            Transform::new(chain * t_base_camera.inverse().isometry() * Isometry3::identity());
        let axes = (t_odom_base.rotation() * t_base_camera.rotation()).to_rotation_matrix();
        let turned = |block: Matrix3<f64>| axes.matrix() * block * axes.matrix().transpose();
        let position = turned(covariance.fixed_view::<3, 3>(0, 0).into()) * self.config.inflation.powi(2);
        let rotation = turned(covariance.fixed_view::<3, 3>(3, 3).into()) * self.config.inflation.powi(2);
        let pose = t_odom_goalbase.planar();
        let here = t_odom_base.planar();
        let range_m = here.distance_to(pose.x_m, pose.y_m);
        let turn_rad = wrap_angle(pose.yaw_rad - here.yaw_rad).abs();
        let floor = (self.config.position_sd_min_m + self.config.position_sd_per_m * range_m).powi(2);
        let mut planar = Matrix3::zeros();
        planar.fixed_view_mut::<2, 2>(0, 0).copy_from(&position.fixed_view::<2, 2>(0, 0));
        planar[(0, 0)] += floor;
        planar[(1, 1)] += floor;
        planar[(2, 2)] = rotation[(2, 2)] + self.config.heading_sd_min_rad.powi(2);
        let sound = [pose.x_m, pose.y_m, pose.yaw_rad, range_m].iter().all(|v| v.is_finite())
            && planar.iter().all(|v| v.is_finite())
            && planar.cholesky().is_some();
        sound.then_some(Measurement { stamp, pose, covariance: planar, evidence, from: here, range_m, turn_rad })
    }

    /// Fuses a measurement with the hypothesis it agrees with best, or opens a new one.
    pub fn join(&mut self, measurement: &Measurement, step: u64) -> Joined {
        let closest = (0..self.hypotheses.len())
            .map(|i| (self.hypotheses[i].distance_square(measurement), i))
            .filter(|(square, _)| *square <= GATE)
            .min_by(|a, b| a.0.total_cmp(&b.0));
        let suffices = |rigour| measurement.evidence.suffices(measurement.range_m, measurement.turn_rad, rigour);
        if let Some((_, i)) = closest {
            if suffices(KNOWN_PLACE * self.rigour) || self.hypotheses[i].is_borne_out_by(measurement) {
                self.hypotheses[i].fuse(measurement, step);
                return Joined::Fused;
            }
            return if Some(i) == self.best_index(step) { Joined::Faint } else { Joined::Weak };
        }
        if !suffices(self.rigour) {
            return Joined::Weak;
        }
        if self
            .liars
            .iter()
            .any(|liar| self.near(&liar.pose, &measurement.pose) && measurement.evidence.n_inliers < 2 * liar.n_inliers)
        {
            return Joined::Refused;
        }
        if self.hypotheses.len() == HYPOTHESES_MAX {
            let weakest =
                (0..HYPOTHESES_MAX).min_by(|&a, &b| self.hypotheses[a].support.total_cmp(&self.hypotheses[b].support));
            if let Some(weakest) = weakest {
                self.hypotheses.remove(weakest);
            }
        }
        self.hypotheses.push(Hypothesis::new(measurement, step));
        Joined::Opened
    }

    /// Believes this measurement, and forgets what was believed before: SLING predicts once, and drives.
    pub fn replace(&mut self, measurement: &Measurement, step: u64) {
        self.hypotheses.clear();
        self.hypotheses.push(Hypothesis::new(measurement, step));
    }

    /// Refines the best-fitting hypothesis by a direction seen from `t_odom_base`. Returns true if one agreed.
    pub fn refine_by_bearing(
        &mut self,
        t_odom_base: &Transform<Odom, Base>,
        t_base_camera: &Transform<Base, Camera>,
        bearing_rad: f64,
        bearing_sd_rad: f64,
        step: u64,
    ) -> bool {
        let here = t_odom_base.planar();
        let axis = camera_azimuth(t_base_camera);
        let sd = (bearing_sd_rad * self.config.inflation).max(self.config.heading_sd_min_rad);
        let Some(best) = self.best_index(step) else { return false };
        let hypothesis = &mut self.hypotheses[best];
        let (dx, dy) = (hypothesis.pose.x_m - here.x_m, hypothesis.pose.y_m - here.y_m);
        let square = dx * dx + dy * dy;
        if square < 0.25 {
            return false;
        }
        let expected = libm::atan2(dy, dx);
        let innovation = wrap_angle(here.yaw_rad + axis + bearing_rad - expected);
        let jacobian = Vector3::new(-dy / square, dx / square, 0.0);
        let agreed = hypothesis.fuse_scalar(&jacobian, innovation, sd * sd);
        if agreed {
            (hypothesis.n_misses, hypothesis.n_missed) = (0, 0);
        }
        agreed
    }

    /// The hypothesis with the most support that may be driven to at `step`.
    #[must_use]
    pub fn best(&self, step: u64) -> Option<&Hypothesis> {
        self.best_index(step).map(|i| &self.hypotheses[i])
    }

    /// All hypotheses.
    #[must_use]
    pub fn hypotheses(&self) -> &[Hypothesis] {
        &self.hypotheses
    }

    /// Perception looked from `pose`, with nothing in between if `clear`, and did not agree with the best hypothesis. From a
    /// view that is no worse than those that did agree, or all but the photo's own, this is held against it, once for each
    /// place unless the view is the photo's own. `n_th` is the switch's threshold, matches; the [ladder](LadderConfig) judges.
    pub fn doubt(&mut self, pose: &PlanarPose, clear: Sightline, n_th: f64, step: u64) -> Doubt {
        let config = self.config;
        let Some(best) = self.best_index(step) else { return Doubt::None };
        let hypothesis = &mut self.hypotheses[best];
        let range_m = pose.distance_to(hypothesis.pose.x_m, hypothesis.pose.y_m);
        let turn_rad = wrap_angle(pose.yaw_rad - hypothesis.pose.yaw_rad).abs();
        let alike = config.ladder.is_there(range_m, turn_rad);
        let no_worse = range_m <= hypothesis.farthest_m && turn_rad <= hypothesis.widest_rad + 0.1;
        if alike {
            hypothesis.n_misses += 1;
        }
        if alike || (no_worse && clear == Sightline::Clear && !hypothesis.was_looked_at_from(pose)) {
            hypothesis.support *= config.miss_factor;
            hypothesis.n_missed += 1;
            hypothesis.missed_from = Some(*pose);
        }
        let climb = Climb {
            range_m,
            support: hypothesis.support,
            n_th,
            n_missed: hypothesis.n_missed,
            n_missed_there: hypothesis.n_misses,
        };
        match config.ladder.standing(&climb) {
            Standing::Dropped => Doubt::Refuted,
            Standing::Confirmed | Standing::Kept => Doubt::None,
        }
    }

    /// The best hypothesis was wrong: drop it and do not believe its place again.
    pub fn condemn(&mut self, step: u64) {
        if let Some(best) = self.best_index(step) {
            let hypothesis = self.hypotheses.remove(best);
            if self.liars.len() == LIARS_MAX {
                self.liars.remove(0);
            }
            self.liars.push(Liar { pose: hypothesis.pose, n_inliers: hypothesis.n_inliers_best });
        }
    }

    /// No way leads to the best hypothesis, or it was not seen for long: leave it until `until_step`.
    pub fn park(&mut self, step: u64, until_step: u64) {
        if let Some(best) = self.best_index(step) {
            self.hypotheses[best].parked_until = until_step;
        }
    }

    /// Nothing else is left: believe liars and parked places again, and ask for less from now on. Returns false if there was
    /// nothing to forgive.
    pub fn forgive(&mut self) -> bool {
        let any = !self.liars.is_empty() || self.hypotheses.iter().any(|h| h.parked_until > 0);
        self.liars.clear();
        self.rigour *= 0.6;
        for hypothesis in &mut self.hypotheses {
            hypothesis.parked_until = 0;
        }
        any
    }

    fn best_index(&self, step: u64) -> Option<usize> {
        (0..self.hypotheses.len())
            .filter(|&i| self.hypotheses[i].parked_until <= step)
            .max_by(|&a, &b| self.hypotheses[a].support.total_cmp(&self.hypotheses[b].support).then(b.cmp(&a)))
    }

    fn near(&self, a: &PlanarPose, b: &PlanarPose) -> bool {
        a.distance_to(b.x_m, b.y_m) <= self.config.liar_m
            && wrap_angle(a.yaw_rad - b.yaw_rad).abs() <= self.config.liar_rad
    }
}

/// Azimuth of the camera's optical axis in the base frame, radians.
pub fn camera_azimuth(t_base_camera: &Transform<Base, Camera>) -> f64 {
    let axis = t_base_camera.rotation() * Vector3::z();
    libm::atan2(axis.y, axis.x)
}
