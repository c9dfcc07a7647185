//! Lockstep: the world stands still until the next action arrives, so the outcome is the same whatever the load.

use std::time::Duration;

use homing_core::{Motion, MotionCommand, MotionResult, RobotBridge};
use homing_privileged::RESET;
use homing_protocol::convert::{Lease, ToDomain};
use homing_protocol::interfaces::homing_msgs::ResetEpisodeResponse;
use homing_protocol::interfaces::homing_msgs::srv::ResetEpisode;
use homing_protocol::{Session, process, topics};
use homing_safety::{CommandGate, GateConfig, Refusal, VelocityLimits, Verdict};

use crate::outgoing::Outgoing;
use crate::world::World;

/// The observation is sent again after so long without a command: somebody may have joined late, or a part was lost.
const AGAIN: Duration = Duration::from_millis(1000);

pub async fn run(session: &Session, mut world: World) -> anyhow::Result<()> {
    let out = Outgoing::announce(session, &world.simulator)?;
    let commands = session.subscribe(&topics::MOTION_COMMAND, 2)?;
    let mut resets = session.serve::<ResetEpisode>(RESET)?;
    let body = world.simulator.capabilities();
    let limits = VelocityLimits::new(body.linear_m_s_max, body.angular_rad_s_max, 1.0, 3.0)?;
    let mut gate = CommandGate::new(GateConfig::new(limits));
    let mut last: Option<MotionResult> = None;
    let mut last_refusal: Option<Refusal> = None;
    let stop = process::termination()?;
    world.describe();

    tokio::pin!(stop);
    loop {
        show(&out, &mut world)?;
        out.body.lease(&lease(&gate, &world, last_refusal.as_ref()))?;
        // Until something changes the world.
        loop {
            tokio::select! {
                () = &mut stop => return Ok(()),
                (question, answer) = resets.next() => {
                    let outcome = world.reset_to(&question.episode_json);
                    if outcome.is_ok() {
                        gate = CommandGate::new(GateConfig::new(limits));
                        last = None;
                    }
                    let message = outcome.as_ref().err().map(|e| format!("{e:#}")).unwrap_or_default();
                    answer.give(&ResetEpisodeResponse { accepted: outcome.is_ok(), message }).await;
                    break;
                }
                command = commands.recv() => {
                    let command = match command.map_err(anyhow::Error::from).and_then(|c| Ok(c.message.to_domain()?)) {
                        Ok(command) => command,
                        Err(cause) => { tracing::warn!("ignored: {cause:#}"); continue; }
                    };
                    release_if_gone(session, &mut gate, &command);
                    match gate.offer(world.simulator.now(), &command) {
                        Verdict::Accepted => {
                            let result = apply(&mut world, &command)?;
                            out.body.result(&result)?;
                            last = Some(result);
                            break;
                        }
                        Verdict::Duplicate => {
                            if let Some(result) = last.filter(|r| (r.session, r.sequence) == (command.session, command.sequence)) {
                                out.body.result(&result)?;
                            }
                            break;
                        }
                        Verdict::Refused(why) => {
                            tracing::warn!(%why, "a command");
                            last_refusal = Some(why);
                        }
                    }
                }
                () = tokio::time::sleep(AGAIN) => break,
            }
        }
    }
}

fn show(out: &Outgoing, world: &mut World) -> anyhow::Result<()> {
    let observation = tokio::task::block_in_place(|| world.simulator.observe())?;
    out.truth(&world.truth(world.simulator.steps()))?;
    Ok(out.body.observation(&observation)?)
}

fn apply(world: &mut World, command: &MotionCommand) -> anyhow::Result<MotionResult> {
    let outcome = world.simulator.apply(command.motion)?;
    world.collisions += u64::from(outcome.blocked);
    world.done |= command.motion == Motion::Stop { done: true };
    Ok(MotionResult { session: command.session, sequence: command.sequence, outcome })
}

/// Time stands still here, so a lease never lapses by itself: a commander that left the network has given it up.
fn release_if_gone(session: &Session, gate: &mut CommandGate, command: &MotionCommand) {
    let stamp = command.stamp;
    if let Some(holder) = gate.lease_at(stamp).map(|l| l.session)
        && holder != command.session
        && session.senders(&topics::MOTION_COMMAND) < 2
    {
        gate.release(holder);
    }
}

fn lease(gate: &CommandGate, world: &World, last_refusal: Option<&Refusal>) -> Lease {
    let stamp = world.simulator.now();
    let counters = gate.counters();
    Lease {
        stamp,
        holder: gate.lease_at(stamp).map(|l| (l.session, gate.epoch())),
        accepted: counters.accepted,
        refused: counters.refused(),
        last_refusal: last_refusal.map(ToString::to_string).unwrap_or_default(),
    }
}
