//! Sessions over a bad network: 100 ms there and back, 20 ms of jitter each way, 5 % lost each way.

use std::time::Duration;

use pita_client::bots::{BotFleet, FleetSettings, FleetTally, ScriptKind};
use pita_client::{ConditionerSettings, Durations};

use crate::{observed, pita_server, stalls_while};

/// There and back on average, and the most that jitter adds both ways, ms.
const ROUND_TRIP_MS: f64 = 100.0;
/// Room for everybody to drive without meeting anybody.
const ARENA: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../configs/arenas/flat.toml");
const CONDITIONS: &str = "latency=50,jitter=20,loss=5,seed=2002";
/// Drivers, and how long they are given to learn the network and then watched.
const BOTS: usize = 4;
const LEARNING: Duration = Duration::from_secs(6);
const WATCHED: Duration = Duration::from_secs(12);

/// Most that the prediction of one's own car may be off, p99, and that another car may be shown from where its motion
/// would have it.
const OWN_CORRECTION_P99_M: f64 = 0.15;
const JUMP_MAX_M: f64 = 0.2;

fn metres(distances_um: &Durations, quantile: f64) -> f64 {
    distances_um.value_at_quantile(quantile) as f64 / 1e6
}

fn ms(durations: &Durations, quantile: f64) -> f64 {
    durations.value_at_quantile(quantile) as f64 / 1e3
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn over_a_bad_network_inputs_take_effect_in_time() {
    let (server, observer) = observed(pita_server().args(["run", "--arena", ARENA])).await;
    let conditions: ConditionerSettings = CONDITIONS.parse().unwrap();
    let settings = FleetSettings {
        scripts: vec![ScriptKind::Circle, ScriptKind::Wander],
        conditioner: Some(conditions),
        watch: true,
        ..FleetSettings::new(&server.endpoint)
    };
    let mut fleet = BotFleet::new(settings);
    fleet.add(BOTS).await.unwrap_or_else(|error| panic!("{error}"));
    tokio::time::sleep(LEARNING).await;
    let before = fleet.tally();
    let since = observer.status().await.unwrap().tick;
    let own_stall = stalls_while(tokio::time::sleep(WATCHED)).await;
    let counted: FleetTally = fleet.tally().since(&before);
    let total = counted.total();
    let ticks = observer.ticks(since).await.unwrap().records;
    let server_stall = ticks.iter().map(|tick| f64::from(tick.late_us) * 1e-3).fold(0.0, f64::max);
    fleet.stop().await;

    let session = &total.session;
    let tick_ms = 1e3 / 30.0;
    // A machine with other things to do delays clients and ticks; what it took is allowed on top.
    let allowed = ROUND_TRIP_MS + 3.0 * tick_ms + 2.0 * own_stall.as_secs_f64() * 1e3 + 2.0 * server_stall;
    let found = format!(
        "effect p50 {:.1} ms, p99 {:.1} ms of {allowed:.1} allowed; jitter p99 {:.1} ms, lead p50 {:.1} ms; inputs: {} in \
         time, {} late, {} superseded, {} early, {} missing; snapshots: {} received, {} missed; own car corrected p99 {:.3} m, worst {:.3} m of {} times; others off p99 {:.3} m, worst {:.3} m; stalls: {own_stall:?} \
         here, {server_stall:.1} ms there",
        ms(&session.latency_us, 0.5),
        ms(&session.latency_us, 0.99),
        ms(&session.jitter_us, 0.99),
        ms(&session.lead_us, 0.5),
        session.inputs_in_time,
        session.inputs_late,
        session.inputs_superseded,
        session.inputs_early,
        session.inputs_missing,
        session.snapshots_received,
        session.snapshots_missed,
        metres(&session.correction_um, 0.99),
        metres(&session.correction_um, 1.0),
        session.correction_um.len(),
        metres(&total.jumps_um, 0.99),
        metres(&total.jumps_um, 1.0),
    );
    eprintln!("{found}");
    assert_eq!((total.connected, total.lost.len()), (BOTS, 0), "{:?}", total.lost);
    assert!(session.snapshots_missed > 0, "the conditioner loses nothing: {found}");
    assert!(ms(&session.latency_us, 0.99) <= allowed, "{found}");
    let looks = 15 * BOTS as u64 * WATCHED.as_secs();
    assert!(
        session.correction_um.len() > looks && total.jumps_um.len() > looks,
        "hardly anything was looked at: {found}"
    );
    assert!(metres(&session.correction_um, 0.99) < OWN_CORRECTION_P99_M, "{found}");
    assert!(metres(&total.jumps_um, 1.0) < JUMP_MAX_M, "{found}");
    assert!(session.inputs_early == 0, "{found}");
    server.stop().unwrap_or_else(|error| panic!("{error}"));
}
