//! One loop for lockstep and real time: hear, and when a moment is complete, step and command.

use std::time::{Duration, Instant};

use homing_core::{Action, Mode, Motion, MotionCommand, MotionResult, Stamp};
use homing_planner::{Mission as PlannerMission, Perception, Planner, PlannerObservation, StepEvent};
use homing_protocol::convert::{EncodedPhoto, ToDomain, ToMessage, to_camera_mount, to_depth};
use homing_protocol::navigate::{Mission, MissionId, MissionReport, NavigateServer, Outcome, Progress};
use homing_protocol::{Session, topics};

use crate::Correction;
use crate::config::Config;
use crate::links::Links;
use crate::moment::Moments;

/// How often the photo is sent again, for a perception that starts late.
const GOAL_PERIOD: Duration = Duration::from_secs(1);
/// The loop looks at its clocks at least this often.
const TICK: Duration = Duration::from_millis(20);
/// Once perception let a whole wait pass, it gets only this much per step until it answers again.
const LATE_ANSWER_MAX: Duration = Duration::from_millis(20);
/// After so many waits in vain, perception counts as hanging.
const MISSES_MAX: u32 = 3;
/// The stop at the end of a mission is sent again for so long.
const CLOSING_MAX: Duration = Duration::from_secs(3);
/// The map is sent with every n-th step: it is for people.
const MAP_EVERY: u64 = 5;

/// Plans and drives.
pub struct Driver {
    planner: Planner,
    config: Config,
    links: Links,
    missions: NavigateServer,
    moments: Moments,
    session_id: u64,
    sequence: u64,
    mission: Option<Active>,
    /// The newest moment without a mission, not yet taken in.
    resting: Option<PlannerObservation>,
    announced: Option<PlannerMission>,
    perception: Answering,
    /// Waits for perception that ended without an answer, in a row.
    misses: u32,
    /// The stop that ended the last mission, until the body confirms it.
    closing: Option<Outstanding>,
    correction: Option<Correction>,
}

/// The mission under way.
struct Active {
    id: MissionId,
    photo: EncodedPhoto,
    photo_sent: Option<Instant>,
    command: Option<Outstanding>,
    result: Option<MotionResult>,
    next_from: Stamp,
    waiting_since: Option<Instant>,
    path_length_m: f64,
}

/// A command that has no result yet.
struct Outstanding {
    command: MotionCommand,
    first_sent: Instant,
    last_sent: Instant,
}

#[derive(Copy, Clone, PartialEq, Eq, Debug)]
enum Answering {
    InTime,
    Late,
    Gone,
}

impl Driver {
    pub fn new(
        planner: Planner,
        config: Config,
        links: Links,
        missions: NavigateServer,
        correction: Option<Correction>,
    ) -> Self {
        Self {
            planner,
            config,
            links,
            missions,
            moments: Moments::default(),
            session_id: rand::random(),
            sequence: 0,
            mission: None,
            resting: None,
            announced: None,
            perception: Answering::InTime,
            misses: 0,
            closing: None,
            correction,
        }
    }

    /// Takes in whatever arrives next; returns after [`TICK`] at the latest.
    pub async fn hear(&mut self) {
        let links = &self.links;
        let heard: anyhow::Result<()> = tokio::select! {
            depth = links.depths.recv() => depth.map_err(Into::into)
                .and_then(|d| { let (stamp, depth) = to_depth(&d.message)?; self.moments.depth(stamp, depth); Ok(()) }),
            info = links.infos.recv() => info.map_err(Into::into)
                .and_then(|i| { let i = i.message.to_domain()?; self.moments.intrinsics(i.stamp, i.intrinsics); Ok(()) }),
            odometry = links.odometry.recv() => odometry.map_err(Into::into)
                .and_then(|o| { if self.moments.odometry(o.message.to_domain()?) { self.start_over(); } Ok(()) }),
            mount = links.mounts.recv() => mount.map_err(Into::into)
                .and_then(|m| { if let Some(mount) = to_camera_mount(&m.message)? { self.moments.mount(mount); } Ok(()) }),
            estimate = links.estimates.recv() => estimate.map_err(Into::into).and_then(|e| {
                let goal_id = self.mission.as_ref().map_or(0, |m| m.photo.id);
                // Who answers at all is waited for again: in lockstep it would else stay a frame behind for good.
                if self.moments.estimate(e.message.to_domain()?, goal_id) && self.perception == Answering::Late {
                    note(&mut self.perception, Answering::InTime);
                }
                Ok(())
            }),
            result = links.results.recv() => result.map_err(Into::into)
                .and_then(|r| { let result = r.message.to_domain()?; self.settle(result); Ok(()) }),
            mission = self.missions.next() => { begin(self, mission); Ok(()) }
            () = tokio::time::sleep(TICK) => Ok(()),
        };
        if let Err(cause) = heard {
            tracing::warn!("ignored: {cause:#}");
        }
    }

    /// Sends what is due, and steps when a moment is complete.
    pub fn act(&mut self, session: &Session) -> anyhow::Result<()> {
        self.send_photo()?;
        self.send_again()?;
        if self.mission.is_none() {
            self.look_around();
        }
        if let Some((observation, perception)) = self.complete_moment(session) {
            self.step(observation, perception)?;
        }
        Ok(())
    }

    /// Without a mission, whoever moves the body shows it around: the map grows, and the odometry is remembered, so that a
    /// goal that is seen on the way can be found later. One moment late: the newest may be the first of a mission.
    fn look_around(&mut self) {
        let from = self.resting.as_ref().map_or(Stamp(0), |o| Stamp(o.odometry.stamp.0.saturating_add(1)));
        let Some(newest) = self.moments.newest(from) else { return };
        if let Some(observation) = self.resting.replace(newest) {
            let stamp = observation.odometry.stamp;
            let mission = self.announced.take();
            let event = StepEvent { mission, observation: Some(observation), ..StepEvent::nothing() };
            self.planner.step(stamp, &event);
        }
    }

    /// Tells the body to stand still, and ends the mission for whoever waits for it.
    pub fn leave(&mut self) {
        if self.mission.is_some() {
            self.stand(Motion::Stop { done: false });
            self.finish(Outcome::Failed, "the planner was stopped".to_owned());
        }
    }

    /// Sends a stop, and again until the body confirms it or a limit is over.
    fn stand(&mut self, motion: Motion) {
        // Stamped with the newest reading of the robot's clock: a stop must not arrive expired.
        let command = self.command(self.moments.clock(), motion);
        if let Err(cause) = self.links.command.publish(&command.to_message()) {
            tracing::error!(%cause, "a stop was not sent; the body's own watchdog stops it");
        }
        let now = Instant::now();
        self.closing = Some(Outstanding { command, first_sent: now, last_sent: now });
    }

    /// The robot's clock began anew: what was decided before it is void.
    fn start_over(&mut self) {
        tracing::warn!("the robot's clock began anew: going on from its new beginning");
        (self.closing, self.resting) = (None, None);
        if let Some(active) = &mut self.mission {
            (active.command, active.result, active.waiting_since) = (None, None, None);
            active.next_from = Stamp(0);
        }
    }

    fn settle(&mut self, result: MotionResult) {
        let answers = |o: &Outstanding| (o.command.session, o.command.sequence) == (result.session, result.sequence);
        if self.closing.as_ref().is_some_and(answers) {
            self.closing = None;
        }
        let Some(active) = &mut self.mission else { return };
        if active.command.as_ref().is_some_and(answers) {
            tracing::debug!(
                sequence = result.sequence,
                at_s = result.outcome.stamp.seconds(),
                blocked = result.outcome.blocked,
                "result"
            );
            active.command = None;
            active.next_from = result.outcome.stamp;
            active.result = Some(result);
        }
    }

    fn send_photo(&mut self) -> anyhow::Result<()> {
        let Some(active) = &mut self.mission else { return Ok(()) };
        if active.photo_sent.is_none_or(|at| at.elapsed() >= GOAL_PERIOD) {
            active.photo_sent = Some(Instant::now());
            self.links.goal.publish(&active.photo.to_message())?;
        }
        Ok(())
    }

    fn send_again(&mut self) -> anyhow::Result<()> {
        if let Some(closing) = &mut self.closing {
            if closing.first_sent.elapsed() > CLOSING_MAX {
                tracing::error!("the body did not confirm the last stop; its own watchdog stops it");
                self.closing = None;
            } else if closing.last_sent.elapsed() >= self.config.pace.resend() {
                closing.last_sent = Instant::now();
                self.links.command.publish(&closing.command.to_message())?;
            }
        }
        let Some(active) = &mut self.mission else { return Ok(()) };
        let Some(outstanding) = &mut active.command else { return Ok(()) };
        if outstanding.first_sent.elapsed() > self.config.pace.result_max() {
            tracing::error!(sequence = outstanding.command.sequence, "the body gave no result; going on without it");
            // In lockstep the world still stands at that moment.
            active.next_from = outstanding.command.stamp;
            active.command = None;
        } else if outstanding.last_sent.elapsed() >= self.config.pace.resend() {
            outstanding.last_sent = Instant::now();
            self.links.command.publish(&outstanding.command.to_message())?;
        }
        Ok(())
    }

    /// The newest moment that perception has answered; without an answer in time, the newest there is.
    fn complete_moment(&mut self, session: &Session) -> Option<(PlannerObservation, Perception)> {
        let active = self.mission.as_mut()?;
        if active.command.is_some() {
            return None;
        }
        if let Some(observation) = self.moments.newest_answered(active.next_from) {
            note(&mut self.perception, Answering::InTime);
            self.misses = 0;
            return Some((observation, Perception::Present));
        }
        let observation = self.moments.newest(active.next_from)?;
        let waiting_since = *active.waiting_since.get_or_insert_with(Instant::now);
        if !session.has_sender(&topics::GOAL_ESTIMATE) {
            note(&mut self.perception, Answering::Gone);
            return Some((observation, Perception::Absent));
        }
        let wait = if self.perception == Answering::Late { LATE_ANSWER_MAX } else { self.config.pace.answer_max() };
        if waiting_since.elapsed() < wait {
            return None;
        }
        note(&mut self.perception, Answering::Late);
        // One late answer is not a perception that hangs.
        self.misses = self.misses.saturating_add(1);
        let perception = if self.misses < MISSES_MAX { Perception::Present } else { Perception::Absent };
        Some((observation, perception))
    }

    fn step(&mut self, observation: PlannerObservation, perception: Perception) -> anyhow::Result<()> {
        let stamp = observation.odometry.stamp;
        let Some(active) = &mut self.mission else { return Ok(()) };
        active.waiting_since = None;
        let motion = active.result.take().map(|r| r.outcome);
        active.path_length_m += motion.map_or(0.0, |m| m.moved.distance_to(0.0, 0.0));
        // The newest answer speaks of the moment at hand, those before of what was seen long ago.
        let mut remembered = self.moments.close(stamp);
        let mut estimate = remembered.pop();
        if let Some(correction) = &self.correction {
            estimate = estimate.map(|e| correction(e, &observation));
        }
        let event = StepEvent {
            mission: self.announced.take(),
            estimate,
            remembered,
            observation: Some(observation),
            motion,
            perception,
        };
        // The clock may have gone on while perception was waited for.
        let action = self.planner.step(self.moments.clock().max(stamp), &event);
        tracing::debug!(at_s = stamp.seconds(), ?action, reason = self.planner.state().reason, "step");
        self.show()?;
        self.carry_out(stamp, action)
    }

    fn carry_out(&mut self, stamp: Stamp, action: Action) -> anyhow::Result<()> {
        let state = self.planner.state();
        let (mode, reason) = (state.mode, state.reason.clone());
        if let Some(outcome) = ended(mode, action) {
            // Only a goal that is believed reached is declared; a planner that gave up just stands.
            self.stand(Motion::Stop { done: outcome == Outcome::Arrived });
            self.finish(outcome, reason);
            return Ok(());
        }
        let body = self.config.planner().body;
        let command = self.command(stamp, action.motion(body.forward_m, body.turn_rad));
        tracing::debug!(sequence = command.sequence, motion = ?command.motion, "command");
        self.links.command.publish(&command.to_message())?;
        if let Some(active) = &mut self.mission {
            let now = Instant::now();
            active.command = Some(Outstanding { command, first_sent: now, last_sent: now });
        }
        Ok(())
    }

    fn command(&mut self, stamp: Stamp, motion: Motion) -> MotionCommand {
        self.sequence += 1;
        MotionCommand {
            session: self.session_id,
            epoch: 0,
            sequence: self.sequence,
            stamp,
            time_to_live: self.config.pace.time_to_live(),
            motion,
        }
    }

    fn show(&self) -> anyhow::Result<()> {
        let state = self.planner.state();
        self.links.state.publish(&state.to_message())?;
        let last = matches!(state.mode, Mode::Arrived | Mode::Failed);
        if state.step % MAP_EVERY == 1 || last {
            self.links.map.publish(&(state.stamp, self.planner.map()).to_message())?;
        }
        let distance = |goal: &homing_core::GoalHypothesis| state.pose.distance_to(goal.pose.x_m, goal.pose.y_m);
        if let Some(active) = &self.mission {
            let progress = Progress {
                step: state.step,
                mode: state.mode,
                goal_distance_m: state.goal.as_ref().map(distance),
                reason: state.reason.clone(),
            };
            self.missions.progress(active.id, &progress);
        }
        Ok(())
    }

    fn finish(&mut self, outcome: Outcome, message: String) {
        let Some(active) = self.mission.take() else { return };
        tracing::info!(?outcome, message, "mission ended");
        let report =
            MissionReport { outcome, steps: self.planner.state().step, path_length_m: active.path_length_m, message };
        self.missions.finish(active.id, &report);
    }
}

fn note(perception: &mut Answering, now: Answering) {
    if *perception != now {
        tracing::warn!(?now, "perception's answers");
        *perception = now;
    }
}

fn ended(mode: Mode, action: Action) -> Option<Outcome> {
    match (mode, action) {
        (Mode::Arrived, _) => Some(Outcome::Arrived),
        (Mode::Failed, _) | (_, Action::Stop) => Some(Outcome::Failed),
        _ => None,
    }
}

fn begin(driver: &mut Driver, mission: Option<Mission>) {
    match mission {
        Some(Mission::Start(id, photo)) => {
            tracing::info!(goal = photo.id, "mission begins");
            driver.moments.clear();
            driver.resting = None;
            driver.announced = Some(PlannerMission::Start { goal_id: photo.id });
            driver.perception = Answering::InTime;
            driver.mission = Some(Active {
                id,
                photo,
                photo_sent: None,
                command: None,
                result: None,
                next_from: Stamp(0),
                waiting_since: None,
                path_length_m: 0.0,
            });
        }
        Some(Mission::Cancel(id)) if driver.mission.as_ref().is_some_and(|active| active.id == id) => {
            driver.stand(Motion::Stop { done: false });
            driver.finish(Outcome::Cancelled, "cancelled by the operator".to_owned());
        }
        // Its mission has ended in the meantime.
        Some(Mission::Cancel(_)) | None => {}
    }
}
