//! What this crate costs over bare zenoh: the same bytes, one run, in turn (A B A B ..), one-way latency.
//!
//! Two sessions of one process on TCP loopback, once with shared memory and once without. Bare zenoh puts the encoded bytes
//! (nothing is copied for it) on a key of its own and receives them from a ring of one, awaited in a task, as this crate's subscription is.
//! Prints medians in microseconds, and the ratio of the medians of each round.

use std::time::{Duration, Instant};

use homing_protocol::interfaces::sensor_msgs::Image;
use homing_protocol::session::{Link, Session, SessionConfig};
use homing_protocol::topics::{Qos, Topic};
use zenoh::Wait;
use zenoh::bytes::ZBytes;
use zenoh::handlers::RingChannel;
use zenoh::qos::CongestionControl;

const FRAME: Topic<Image> = Topic::new("overhead/frame", "example", Qos::Frame, "as fast as answered", 16 << 20);
const ROUNDS: usize = 7;
const MESSAGES: usize = 300;

type AnyError = Box<dyn std::error::Error + Send + Sync>;

#[tokio::main]
async fn main() -> Result<(), AnyError> {
    println!(
        "{:<34} {:>12} {:>12} {:>22}",
        "one-way latency, median", "bare, us", "ours, us", "ours / bare (min..max)"
    );
    for (name, bytes, shared_memory, port) in [
        ("60 kB, TCP", 60_000, false, 17_447),
        ("60 kB, shared memory", 60_000, true, 17_448),
        ("921600 B, TCP", 921_600, false, 17_449),
        ("921600 B, shared memory", 921_600, true, 17_450),
    ] {
        let (bare, ours, ratios) = compare(bytes, shared_memory, port).await?;
        let (low, high) = (ratios.first().copied().unwrap_or(0.0), ratios.last().copied().unwrap_or(0.0));
        let middle = ratios[ratios.len() / 2];
        println!("{name:<34} {bare:>12.1} {ours:>12.1} {middle:>8.2} ({low:.2}..{high:.2})");
    }
    Ok(())
}

async fn compare(bytes: usize, shared_memory: bool, port: u16) -> Result<(f64, f64, Vec<f64>), AnyError> {
    let endpoint = vec![format!("tcp/127.0.0.1:{port}")];
    let config = |node: &str, link| SessionConfig { shared_memory, ..SessionConfig::new(node, link) };
    let sender = Session::open(&config("sender", Link::Listen(endpoint.clone())))?;
    let receiver = Session::open(&config("receiver", Link::Connect(endpoint)))?;
    let message = Image {
        width: 640,
        height: 480,
        encoding: "rgb8".into(),
        data: vec![7_u8; bytes].into(),
        ..Default::default()
    };
    let publisher = sender.publisher(&FRAME)?;
    let subscription = receiver.subscribe(&FRAME, 1)?;

    let key = "overhead/bare";
    let bare_subscriber = receiver.zenoh().declare_subscriber(key).with(RingChannel::new(1)).wait()?;
    let bare_publisher =
        sender.zenoh().declare_publisher(key).congestion_control(CongestionControl::BlockFirst).wait()?;
    let payload = ZBytes::from(vec![7_u8; bytes + 64]);
    tokio::time::sleep(Duration::from_millis(500)).await;

    let (mut bare_all, mut ours_all, mut ratios) = (Vec::new(), Vec::new(), Vec::new());
    for _ in 0..ROUNDS {
        let mut bare = Vec::with_capacity(MESSAGES);
        for _ in 0..MESSAGES {
            let began = Instant::now();
            bare_publisher.put(payload.clone()).wait()?;
            let sample = bare_subscriber.recv_async().await?;
            std::hint::black_box(sample.payload().to_bytes().len());
            bare.push(began.elapsed().as_secs_f64() * 1e6);
        }
        let mut ours = Vec::with_capacity(MESSAGES);
        for _ in 0..MESSAGES {
            let began = Instant::now();
            publisher.publish(&message)?;
            std::hint::black_box(subscription.recv().await?.message.height);
            ours.push(began.elapsed().as_secs_f64() * 1e6);
        }
        ratios.push(median(&mut ours) / median(&mut bare));
        bare_all.append(&mut bare);
        ours_all.append(&mut ours);
    }
    ratios.sort_by(f64::total_cmp);
    receiver.close();
    sender.close();
    Ok((median(&mut bare_all), median(&mut ours_all), ratios))
}

fn median(values: &mut [f64]) -> f64 {
    values.sort_by(f64::total_cmp);
    values[values.len() / 2]
}
