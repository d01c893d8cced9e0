//! Drives in a circle for ten seconds and says where it got to.
//!
//! ```text
//! cargo run -p pita-client --example drive [ENDPOINT]
//! ```

use std::time::{Duration, Instant};

use pita_client::{ClientError, Controls, Session};
use pita_protocol::DEFAULT_ENDPOINT;

#[tokio::main]
async fn main() -> Result<(), ClientError> {
    let endpoint = std::env::args().nth(1).unwrap_or_else(|| DEFAULT_ENDPOINT.to_owned());
    let session = Session::connect(&endpoint, "Circler").await?;
    println!("slot {} of {}, {} ticks a second", session.slot(), session.description().title, session.tick_hz());

    let until = Instant::now() + Duration::from_secs(10);
    while Instant::now() < until {
        tokio::time::sleep_until(session.next_input_due().into()).await;
        let sequence = session.send(Controls { throttle: 0.2, steer: -0.8, ..Controls::default() }).await?;
        if sequence % 30 == 0
            && let Some([x, y, z]) = position(&session)
        {
            println!("input {sequence}: {x:.1} {y:.1} {z:.1} m");
        }
    }

    let counts = session.leave().await;
    let (p50, p99) = (counts.latency_us.value_at_quantile(0.5), counts.latency_us.value_at_quantile(0.99));
    println!("{} snapshots, {} missed", counts.snapshots_received, counts.snapshots_missed);
    println!("input to effect: {:.1} ms p50, {:.1} ms p99", p50 as f64 / 1e3, p99 as f64 / 1e3);
    Ok(())
}

/// Where the session's own actor is, as it would be drawn now, m.
fn position(session: &Session) -> Option<[f32; 3]> {
    let root = session.roster().root_slice(session.actor()?)?;
    let world = session.world_at(Instant::now())?;
    let slice = world.slices.iter().find(|slice| slice.id == root)?;
    slice.q[..3].try_into().ok()
}
