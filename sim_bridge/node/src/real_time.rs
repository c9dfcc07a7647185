//! Real time: the world goes on by the wall clock, and every command passes the safety supervisor.

use std::time::{Duration, Instant};

use homing_core::{Motion, MotionCommand, RobotBridge};
use homing_privileged::RESET;
use homing_protocol::convert::{Lease, ToDomain, to_velocity};
use homing_protocol::interfaces::homing_msgs::ResetEpisodeResponse;
use homing_protocol::interfaces::homing_msgs::srv::ResetEpisode;
use homing_protocol::{Session, process, topics};
use homing_safety::{Event, Supervisor, SupervisorConfig, Verdict};
use homing_sim::LaserConfig;

use crate::outgoing::Outgoing;
use crate::world::World;

/// Physics, odometry and orders: 50 Hz.
const TICK: Duration = Duration::from_millis(20);
/// A stall longer than this does not make the robot jump: the world loses the time instead.
const TICK_MAX: Duration = Duration::from_millis(60);
const SCAN_PERIOD: Duration = Duration::from_millis(100);
const LEASE_PERIOD: Duration = Duration::from_millis(500);

pub async fn run(session: &Session, world: World, frame_period: Duration) -> anyhow::Result<()> {
    let out = Outgoing::announce(session, &world.simulator)?;
    let commands = session.subscribe(&topics::MOTION_COMMAND, 4)?;
    let velocities = session.subscribe(&topics::CMD_VEL, 1)?;
    let mut resets = session.serve::<ResetEpisode>(RESET)?;
    let mut body = Body::new(world, out)?;
    let stop = process::termination()?;
    body.world.describe();

    tokio::pin!(stop);
    let mut tick = tokio::time::interval(TICK);
    tick.set_missed_tick_behavior(tokio::time::MissedTickBehavior::Skip);
    let mut due = Due { frame: Instant::now(), scan: Instant::now(), lease: Instant::now() };
    let ended = loop {
        tokio::select! {
            () = &mut stop => break Ok(()),
            (question, answer) = resets.next() => {
                let outcome = body.reset(&question.episode_json);
                let message = outcome.as_ref().err().map(|e| format!("{e:#}")).unwrap_or_default();
                answer.give(&ResetEpisodeResponse { accepted: outcome.is_ok(), message }).await;
            }
            command = commands.recv() => match command.map_err(anyhow::Error::from).and_then(|c| Ok(c.message.to_domain()?)) {
                Ok(command) => body.command(&command),
                Err(cause) => tracing::warn!("ignored: {cause:#}"),
            },
            velocity = velocities.recv() => match velocity.map_err(anyhow::Error::from).and_then(|v| Ok(to_velocity(&v.message)?)) {
                Ok((linear_m_s, angular_rad_s)) => body.teleop(linear_m_s, angular_rad_s),
                Err(cause) => tracing::warn!("ignored: {cause:#}"),
            },
            _ = tick.tick() => {
                body.release_if_gone(session);
                if let Err(cause) = tokio::task::block_in_place(|| body.tick(&mut due, frame_period)) {
                    break Err(cause);
                }
            }
        }
    };
    // However it ended, the robot stands.
    body.stand().and(ended)
}

struct Due {
    frame: Instant,
    scan: Instant,
    lease: Instant,
}

struct Body {
    world: World,
    out: Outgoing,
    supervisor: Supervisor,
    config: SupervisorConfig,
    last_tick: Instant,
    last_command: Option<MotionCommand>,
    last_refusal: String,
    steps: u64,
}

impl Body {
    fn new(world: World, out: Outgoing) -> anyhow::Result<Self> {
        let config = SupervisorConfig::for_body(world.simulator.capabilities())?;
        Ok(Self {
            world,
            out,
            supervisor: Supervisor::new(config),
            config,
            last_tick: Instant::now(),
            last_command: None,
            last_refusal: String::new(),
            steps: 0,
        })
    }

    fn reset(&mut self, episode_json: &str) -> anyhow::Result<()> {
        self.world.reset_to(episode_json)?;
        self.supervisor = Supervisor::new(self.config);
        (self.last_command, self.steps) = (None, 0);
        Ok(())
    }

    fn command(&mut self, command: &MotionCommand) {
        match self.supervisor.command(self.world.simulator.now(), command) {
            Verdict::Accepted => self.last_command = Some(*command),
            Verdict::Duplicate => {}
            Verdict::Refused(why) => self.refuse(why.to_string()),
        }
    }

    fn teleop(&mut self, linear_m_s: f64, angular_rad_s: f64) {
        if let Verdict::Refused(why) = self.supervisor.teleop(self.world.simulator.now(), linear_m_s, angular_rad_s) {
            self.refuse(why.to_string());
        }
    }

    fn refuse(&mut self, why: String) {
        if why != self.last_refusal {
            tracing::warn!(why, "a command");
            self.last_refusal = why;
        }
    }

    /// A commander that left the network has given up its lease, and its motion ends.
    fn release_if_gone(&mut self, session: &Session) {
        if let Some(lease) = self.supervisor.lease()
            && !session.has_sender(&topics::MOTION_COMMAND)
        {
            self.supervisor.release(self.world.simulator.now(), lease.session);
        }
    }

    fn tick(&mut self, due: &mut Due, frame_period: Duration) -> anyhow::Result<()> {
        let wall = Instant::now();
        let elapsed = wall.duration_since(self.last_tick).min(TICK_MAX);
        self.last_tick = wall;
        let order = self.supervisor.tick(self.world.simulator.now());
        let outcome = self.world.simulator.step_velocity(order.linear_m_s, order.angular_rad_s, elapsed)?;
        self.world.collisions += u64::from(outcome.blocked);
        let now = self.world.simulator.now();
        let scan = is_due(&mut due.scan, SCAN_PERIOD).then(|| {
            let simulator = &self.world.simulator;
            simulator.arena().laser().scan(&simulator.pose_truth(), &LaserConfig::default(), now)
        });
        let odometry = self.world.simulator.odometry();
        self.supervisor.sense(now, &odometry, scan.as_ref());
        self.answer()?;
        self.out.body.odometry(&odometry)?;
        if is_due(&mut due.frame, frame_period) {
            self.out.truth(&self.world.truth(self.steps))?;
            let observation = self.world.simulator.observe()?;
            self.out.body.observation(&observation)?;
        }
        if is_due(&mut due.lease, LEASE_PERIOD) {
            self.say_lease()?;
        }
        Ok(())
    }

    fn answer(&mut self) -> anyhow::Result<()> {
        for event in self.supervisor.take_events() {
            match event {
                Event::Finished(result) => {
                    let command =
                        self.last_command.filter(|c| (c.session, c.sequence) == (result.session, result.sequence));
                    if let Some(command) = command {
                        self.steps += 1;
                        self.world.done |= command.motion == Motion::Stop { done: true };
                        self.last_command = None;
                        self.out.truth(&self.world.truth(self.steps))?;
                    }
                    self.out.body.result(&result)?;
                }
                Event::Silenced { session } => tracing::warn!(session, "commands fell silent: the robot was stopped"),
                Event::TakenOver { session, epoch } => tracing::info!(session, epoch, "an operator took over"),
            }
        }
        Ok(())
    }

    fn say_lease(&self) -> anyhow::Result<()> {
        let counters = self.supervisor.counters();
        Ok(self.out.body.lease(&Lease {
            stamp: self.world.simulator.now(),
            holder: self.supervisor.lease().map(|l| (l.session, self.supervisor.epoch())),
            accepted: counters.accepted,
            refused: counters.refused(),
            last_refusal: self.last_refusal.clone(),
        })?)
    }

    /// Stands still, and says so, before the process leaves.
    fn stand(mut self) -> anyhow::Result<()> {
        self.supervisor.halt(self.world.simulator.now());
        self.world.simulator.stop();
        self.answer()?;
        Ok(self.out.body.odometry(&self.world.simulator.odometry())?)
    }
}

fn is_due(at: &mut Instant, period: Duration) -> bool {
    let now = Instant::now();
    if now < *at {
        return false;
    }
    *at = (*at + period).max(now);
    true
}
