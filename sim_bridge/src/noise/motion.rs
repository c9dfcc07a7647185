//! What noise makes of motions: where the body really goes, and where its odometry believes it went.
//!
//! The mixtures of [`super::ans`] are for 0.25 m and 10 degrees, and the benchmark's robot turns by 15 degrees, and by any
//! angle in its last turn. [`ActuationNoise::Ans`] and [`PoseNoise::Ans`] therefore take the error about the motion meant
//! in proportion to what was commanded: a turn of 15 degrees has 1.5 times the error of one of 10, a step back the error
//! of a step ahead with its sign turned. [`ActuationNoise::AnsRaw`] replays the mixture as published, whatever the amount.
//!
//! A velocity is applied in many short pieces. One error is drawn for each 0.25 m or 10 degrees of it and spread evenly
//! over them, so that the same way has the same noise however often the velocity was commanded.

use homing_core::{PlanarPose, wrap_angle};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;

use super::ans::{AnsMixtures, Maneuver, STEP_M, STEP_RAD};
use super::{ActuationNoise, PoseNoise};

/// What was asked of a body, after its limits.
#[derive(Copy, Clone, Debug, PartialEq)]
pub enum Command {
    /// One motion straight ahead, negative backwards.
    Forward {
        /// Metres.
        distance_m: f64,
    },
    /// One turn in place, left positive.
    Turn {
        /// Radians.
        angle_rad: f64,
    },
    /// A piece of a motion by velocities.
    Velocity {
        /// Way of the piece, metres.
        distance_m: f64,
        /// Turn of the piece, radians, left positive.
        angle_rad: f64,
    },
    /// To stand: makes no noise, as no command of nothing does.
    Stand,
}

impl Command {
    /// The motion meant, a velocity's arc stretched out.
    fn meant(self) -> PlanarPose {
        let (x_m, yaw_rad) = match self {
            Command::Forward { distance_m } => (distance_m, 0.0),
            Command::Turn { angle_rad } => (0.0, angle_rad),
            Command::Velocity { distance_m, angle_rad } => (distance_m, angle_rad),
            Command::Stand => (0.0, 0.0),
        };
        PlanarPose { x_m, y_m: 0.0, yaw_rad }
    }

    /// Its measured motions, each with the share of the measured amount; negative shares are backwards.
    fn shares(self) -> impl Iterator<Item = (Maneuver, f64)> {
        let PlanarPose { x_m, yaw_rad, .. } = self.meant();
        let side = if yaw_rad > 0.0 { Maneuver::Left } else { Maneuver::Right };
        let all = [(Maneuver::Forward, x_m / STEP_M), (side, yaw_rad.abs() / STEP_RAD)];
        all.into_iter().filter(|(_, share)| *share != 0.0)
    }

    fn is_piece(self) -> bool {
        matches!(self, Command::Velocity { .. })
    }
}

/// Errors of one family of mixtures, drawn as they are needed.
#[derive(Clone, Debug)]
struct Source {
    mixtures: AnsMixtures,
    stream: u64,
    rng: ChaCha8Rng,
    held: [Held; 3],
}

/// The error that is being spread over a velocity, and what is left of the amount it is for.
#[derive(Copy, Clone, Debug, Default)]
struct Held {
    error: PlanarPose,
    share_left: f64,
}

impl Source {
    fn new(mixtures: AnsMixtures, stream: u64) -> Self {
        Self { mixtures, stream, rng: ChaCha8Rng::seed_from_u64(0), held: [Held::default(); 3] }
    }

    /// Every family draws from a stream of its own, so that one does not change when another is switched off.
    fn reset(&mut self, seed: u64) {
        self.rng = ChaCha8Rng::seed_from_u64(seed);
        self.rng.set_stream(self.stream);
        self.held = [Held::default(); 3];
    }

    fn draw(&mut self, maneuver: Maneuver) -> PlanarPose {
        self.mixtures.draw(maneuver, &mut self.rng)
    }

    /// The error about a command, in proportion to its amount.
    fn scaled(&mut self, command: Command) -> PlanarPose {
        let mut sum = PlanarPose::default();
        for (maneuver, share) in command.shares() {
            let error =
                if command.is_piece() { self.spread(maneuver, share) } else { times(&self.draw(maneuver), share) };
            sum = plus(&sum, &error);
        }
        sum
    }

    fn spread(&mut self, maneuver: Maneuver, share: f64) -> PlanarPose {
        let (mut sum, mut left) = (PlanarPose::default(), share.abs());
        while left > 0.0 {
            if self.held[maneuver as usize].share_left <= 0.0 {
                self.held[maneuver as usize] = Held { error: self.draw(maneuver), share_left: 1.0 };
            }
            let held = &mut self.held[maneuver as usize];
            let part = left.min(held.share_left);
            held.share_left -= part;
            left -= part;
            sum = plus(&sum, &times(&held.error, part.copysign(share)));
        }
        sum
    }

    /// The error as drawn for one measured motion, whatever the amount; for a piece of a velocity the one being spread.
    fn whole(&mut self, command: Command) -> PlanarPose {
        let Some((maneuver, share)) = command.shares().next() else { return PlanarPose::default() };
        if command.is_piece() {
            self.scaled(command);
            return times(&self.held[maneuver as usize].error, share.signum());
        }
        times(&self.draw(maneuver), share.signum())
    }
}

/// Noise of the wheels and of the odometry over one episode.
#[derive(Clone, Debug)]
pub struct MotionNoise {
    pose: PoseNoise,
    actuation: ActuationNoise,
    sensor: Source,
    wheels: Source,
    believed: PlanarPose,
}

impl MotionNoise {
    /// Draws nothing before [`MotionNoise::reset`].
    #[must_use]
    pub fn new(pose: PoseNoise, actuation: ActuationNoise) -> Self {
        let sensor = Source::new(AnsMixtures::sensor(), 1);
        let wheels = Source::new(AnsMixtures::actuation(), 2);
        let mut noise = Self { pose, actuation, sensor, wheels, believed: PlanarPose::default() };
        noise.reset(0);
        noise
    }

    /// Begins anew: equal seeds and commands give equal noise.
    pub fn reset(&mut self, seed: u64) {
        self.sensor.reset(seed);
        self.wheels.reset(seed);
        self.believed = PlanarPose::default();
    }

    /// The motion that the wheels make of a command, in the base frame before it: first along x and y, then the turn
    /// (Active Neural SLAM). `None` where there is no noise: the body moves as commanded.
    pub fn actuate(&mut self, command: Command) -> Option<PlanarPose> {
        let (maneuver, share) = command.shares().next()?;
        match self.actuation {
            ActuationNoise::Off => None,
            ActuationNoise::AnsRaw if !command.is_piece() => {
                let motion = plus(&maneuver.nominal(), &self.wheels.draw(maneuver));
                Some(times(&motion, share.signum()))
            }
            ActuationNoise::Ans | ActuationNoise::AnsRaw => {
                let error = self.wheels.scaled(command);
                Some(plus(&command.meant(), &error))
            }
        }
    }

    /// Tells what a command really came to: the pose before it in the odometry frame were there no noise, and the motion
    /// made, in the base frame before it.
    pub fn sense(&mut self, command: Command, before: &PlanarPose, made: &PlanarPose) {
        self.believed = match self.pose {
            PoseNoise::Off => return,
            PoseNoise::Ans => moved_by(&self.believed, &plus(made, &self.sensor.scaled(command))),
            PoseNoise::NrnsPublished => {
                let error = self.sensor.whole(command);
                moved_by(before, &PlanarPose { x_m: made.x_m + error.x_m, y_m: made.y_m + error.y_m, ..*made })
            }
        };
    }

    /// Where the odometry believes the body to be, odometry frame; `None` if it is exact.
    #[must_use]
    pub fn believed(&self) -> Option<PlanarPose> {
        (self.pose != PoseNoise::Off).then_some(self.believed)
    }
}

fn plus(a: &PlanarPose, b: &PlanarPose) -> PlanarPose {
    PlanarPose { x_m: a.x_m + b.x_m, y_m: a.y_m + b.y_m, yaw_rad: a.yaw_rad + b.yaw_rad }
}

fn times(a: &PlanarPose, factor: f64) -> PlanarPose {
    PlanarPose { x_m: a.x_m * factor, y_m: a.y_m * factor, yaw_rad: a.yaw_rad * factor }
}

/// A pose after a motion given in its own frame.
fn moved_by(pose: &PlanarPose, motion: &PlanarPose) -> PlanarPose {
    let (cos, sin) = (libm::cos(pose.yaw_rad), libm::sin(pose.yaw_rad));
    PlanarPose {
        x_m: pose.x_m + cos * motion.x_m - sin * motion.y_m,
        y_m: pose.y_m + sin * motion.x_m + cos * motion.y_m,
        yaw_rad: wrap_angle(pose.yaw_rad + motion.yaw_rad),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::constants::TURN_RAD;

    const STEP: Command = Command::Forward { distance_m: STEP_M };
    const STILL: PlanarPose = PlanarPose { x_m: 0.0, y_m: 0.0, yaw_rad: 0.0 };

    fn noise(pose: PoseNoise, actuation: ActuationNoise, seed: u64) -> MotionNoise {
        let mut noise = MotionNoise::new(pose, actuation);
        noise.reset(seed);
        noise
    }

    /// Distances between belief and truth after each of many steps around a square of 10 by 10 steps.
    fn drift_m(pose: PoseNoise, seed: u64) -> Vec<f64> {
        let mut noise = noise(pose, ActuationNoise::Off, seed);
        let mut truth = STILL;
        let mut drift_m = Vec::new();
        for k in 0..400 {
            let turn = k % 10 == 9;
            let command = if turn { Command::Turn { angle_rad: TURN_RAD } } else { STEP };
            noise.sense(command, &truth, &command.meant());
            truth = moved_by(&truth, &command.meant());
            let believed = noise.believed().unwrap_or(truth);
            drift_m.push(believed.distance_to(truth.x_m, truth.y_m));
            if pose == PoseNoise::NrnsPublished {
                assert!(wrap_angle(believed.yaw_rad - truth.yaw_rad).abs() < 1e-12, "the heading is the true one");
            }
        }
        drift_m
    }

    #[test]
    fn errors_accumulate_but_for_the_published_noise() {
        for seed in 0..5 {
            let drift = drift_m(PoseNoise::Ans, seed);
            assert!(drift[399] > 0.3 && drift[399] > 3.0 * drift[39], "{} after 40 steps, {}", drift[39], drift[399]);
            let published = drift_m(PoseNoise::NrnsPublished, seed);
            // 2 cm for a turn, deviations below 3 mm.
            assert!(published.iter().all(|d| (0.0..0.035).contains(d)), "{published:?}");
            assert!(published.iter().filter(|d| **d > 1e-6).count() == 400, "every motion has its error");
        }
    }

    #[test]
    fn no_noise_changes_nothing() {
        let mut off = noise(PoseNoise::Off, ActuationNoise::Off, 3);
        off.sense(STEP, &STILL, &STEP.meant());
        assert_eq!((off.actuate(STEP), off.believed()), (None, None));
    }

    #[test]
    fn standing_and_commands_of_nothing_make_no_noise() {
        let nothing = [
            Command::Stand,
            Command::Forward { distance_m: 0.0 },
            Command::Turn { angle_rad: 0.0 },
            Command::Velocity { distance_m: 0.0, angle_rad: 0.0 },
        ];
        for actuation in [ActuationNoise::Ans, ActuationNoise::AnsRaw] {
            let mut noise = noise(PoseNoise::Ans, actuation, 3);
            for command in nothing {
                noise.sense(command, &STILL, &STILL);
                assert_eq!((noise.actuate(command), noise.believed()), (None, Some(STILL)), "{command:?}");
            }
        }
    }

    #[test]
    fn equal_seeds_give_equal_bits_and_a_reset_begins_anew() {
        let run = |noise: &mut MotionNoise| {
            let commands = [STEP, Command::Turn { angle_rad: -0.1 }, STEP];
            commands.map(|command| {
                let made = noise.actuate(command).unwrap_or(STILL);
                noise.sense(command, &STILL, &made);
                let believed = noise.believed().unwrap_or(STILL);
                [made.x_m, made.y_m, made.yaw_rad, believed.x_m, believed.y_m, believed.yaw_rad].map(f64::to_bits)
            })
        };
        let mut a = noise(PoseNoise::Ans, ActuationNoise::Ans, 7);
        let first = run(&mut a);
        a.reset(7);
        assert_eq!(run(&mut a), first);
        assert_eq!(run(&mut noise(PoseNoise::Ans, ActuationNoise::Ans, 7)), first);
        assert_ne!(run(&mut noise(PoseNoise::Ans, ActuationNoise::Ans, 8)), first);
    }

    #[test]
    fn the_wheels_noise_does_not_depend_on_the_odometrys() {
        let mut with = noise(PoseNoise::Ans, ActuationNoise::Ans, 9);
        let mut without = noise(PoseNoise::Off, ActuationNoise::Ans, 9);
        for _ in 0..5 {
            with.sense(STEP, &STILL, &STEP.meant());
            without.sense(STEP, &STILL, &STEP.meant());
            assert_eq!(with.actuate(STEP), without.actuate(STEP));
        }
    }

    #[test]
    fn errors_are_in_proportion_to_the_command_or_as_published() {
        let turned = |actuation, angle_rad| {
            let made = noise(PoseNoise::Off, actuation, 4).actuate(Command::Turn { angle_rad });
            made.unwrap_or(STILL)
        };
        let (ten, fifteen) = (turned(ActuationNoise::Ans, STEP_RAD), turned(ActuationNoise::Ans, 1.5 * STEP_RAD));
        assert!((fifteen.yaw_rad - 1.5 * ten.yaw_rad).abs() < 1e-12 && (fifteen.y_m - 1.5 * ten.y_m).abs() < 1e-12);
        let raw = turned(ActuationNoise::AnsRaw, 1.5 * STEP_RAD);
        assert_eq!(raw, turned(ActuationNoise::AnsRaw, STEP_RAD));
        assert!((raw.yaw_rad - ten.yaw_rad).abs() < 1e-12, "a turn of 10 degrees is the same in both");
        assert!((10.0..12.7).contains(&raw.yaw_rad.to_degrees()), "{raw:?}");
        let right = turned(ActuationNoise::AnsRaw, -1.5 * STEP_RAD);
        assert!((-13.1..-9.1).contains(&right.yaw_rad.to_degrees()), "{right:?}");
        let stepped =
            |distance_m| noise(PoseNoise::Off, ActuationNoise::Ans, 4).actuate(Command::Forward { distance_m });
        let (ahead, back) = (stepped(0.25).unwrap_or(STILL), stepped(-0.25).unwrap_or(STILL));
        assert_eq!(times(&ahead, -1.0), back);
    }

    #[test]
    fn a_velocity_in_pieces_has_the_noise_of_the_whole() {
        let mut one = noise(PoseNoise::Ans, ActuationNoise::Ans, 6);
        one.sense(STEP, &STILL, &STILL);
        let whole = one.believed().unwrap_or(STILL);
        for pieces in [1_u32, 7, 100] {
            let mut noise = noise(PoseNoise::Ans, ActuationNoise::Ans, 6);
            let mut sum = STILL;
            for _ in 0..pieces {
                let piece = Command::Velocity { distance_m: STEP_M / f64::from(pieces), angle_rad: 0.0 };
                noise.sense(piece, &STILL, &STILL);
                sum = plus(&sum, &noise.actuate(piece).unwrap_or(STILL));
            }
            let believed = noise.believed().unwrap_or(STILL);
            assert!(believed.distance_to(whole.x_m, whole.y_m) < 1e-6, "{pieces}: {believed:?} and {whole:?}");
            let made = one.clone().actuate(STEP).unwrap_or(STILL);
            assert!(
                (sum.x_m - made.x_m).abs() < 1e-9 && (sum.yaw_rad - made.yaw_rad).abs() < 1e-9,
                "{sum:?}, {made:?}"
            );
        }
    }
}
