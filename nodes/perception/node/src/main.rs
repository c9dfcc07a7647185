//! The perception process: RGB-D frames and a goal photo in, goal estimates out.

mod answer;
mod config;
mod features;

use std::process::ExitCode;

use clap::Parser;
use homing_core::RgbdFrame;
use homing_protocol::assemble::Part;
use homing_protocol::convert::{ToDomain, ToMessage, to_depth, to_rgb};
use homing_protocol::process::{self, ProcessArgs, Unusable};
use homing_protocol::{FrameAssembler, Session, topics};

use crate::answer::Answerer;
use crate::config::Config;

/// Tells, for every RGB-D frame, where the place of the goal photo is.
#[derive(Parser)]
#[command(name = "homing-perception", version)]
struct Args {
    #[command(flatten)]
    process: ProcessArgs,
}

fn main() -> ExitCode {
    process::run(&Args::parse().process, run)
}

#[tokio::main]
async fn run(config: Config) -> anyhow::Result<()> {
    let choice = config.choice().map_err(Unusable::new)?;
    let mut answerer = Answerer::new(config.perception(), config.memory(), &choice).map_err(Unusable::new)?;
    tracing::info!("features: {} + {}", choice.extractor.name(), choice.matcher.name());
    let session = Session::open(&config.session.session("perception"))?;
    let colors = session.subscribe(&topics::CAMERA_COLOR, 2)?;
    let depths = session.subscribe(&topics::CAMERA_DEPTH, 2)?;
    let infos = session.subscribe(&topics::CAMERA_INFO, 2)?;
    let goals = session.subscribe(&topics::GOAL_IMAGE, 1)?;
    let estimates = session.publisher(&topics::GOAL_ESTIMATE)?;
    let stop = process::termination()?;
    tracing::info!("perception is ready");

    let mut assembler = FrameAssembler::default();
    tokio::pin!(stop);
    loop {
        let answers = tokio::select! {
            () = &mut stop => break,
            color = colors.recv() => color.map_err(anyhow::Error::from)
                .and_then(|c| Ok(to_rgb(&c.message)?))
                .and_then(|(stamp, rgb)| frame_answers(&mut answerer, assembler.add(stamp, Part::Rgb(rgb))?, stamp)),
            depth = depths.recv() => depth.map_err(anyhow::Error::from)
                .and_then(|d| Ok(to_depth(&d.message)?))
                .and_then(|(stamp, depth)| frame_answers(&mut answerer, assembler.add(stamp, Part::Depth(depth))?, stamp)),
            info = infos.recv() => info.map_err(anyhow::Error::from)
                .and_then(|i| Ok(i.message.to_domain()?))
                .and_then(|i| frame_answers(&mut answerer, assembler.add(i.stamp, Part::Intrinsics(i.intrinsics))?, i.stamp)),
            goal = goals.recv() => goal.map_err(anyhow::Error::from)
                .and_then(|g| Ok(g.message.to_domain()?))
                .and_then(|photo| tokio::task::block_in_place(|| answerer.show(photo))),
        };
        match answers {
            Ok(answers) => answers.iter().try_for_each(|estimate| estimates.publish(&estimate.to_message()))?,
            // Whatever came was not usable: say so, and go on with the next.
            Err(cause) => tracing::warn!("ignored: {cause:#}"),
        }
    }
    session.close();
    Ok(())
}

fn frame_answers(
    answerer: &mut Answerer,
    frame: Option<RgbdFrame>,
    stamp: homing_core::Stamp,
) -> anyhow::Result<Vec<homing_core::GoalEstimate>> {
    Ok(match frame {
        Some(frame) => vec![tokio::task::block_in_place(|| answerer.look(frame))?],
        None => answerer.again(stamp).into_iter().collect(),
    })
}
