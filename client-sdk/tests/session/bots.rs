//! A fleet of bots against the fake: they join, send at the tick rate, are counted, and leave.

use std::{
    collections::HashSet,
    sync::Arc,
    time::{Duration, Instant},
};

use pita_client::ClientError;
use pita_client::bots::{BotFleet, FleetSettings, ScriptKind};
use pita_protocol::{
    encode,
    message::{JoinReply, Refusal, Role, Snapshot},
};

use crate::{
    SOON,
    fake_server::{self, EPOCH, EVENTS_BEFORE, FakeServer, SLOT, ack},
    soon,
};

fn fleet(server: &FakeServer) -> BotFleet {
    BotFleet::new(settings(server))
}

fn settings(server: &FakeServer) -> FleetSettings {
    FleetSettings {
        arena: Some(fake_server::ARENA.to_owned()),
        scripts: vec![ScriptKind::Circle, ScriptKind::Chase],
        connect_timeout: SOON,
        loss_timeout: SOON,
        ..FleetSettings::new(&server.endpoint)
    }
}

/// Sends every slot its snapshots, each car `step` m further a tick, until it is aborted.
pub fn run_world(server: Arc<FakeServer>, slots: u16, step: f32) -> tokio::task::JoinHandle<()> {
    tokio::spawn(async move {
        let mut ticks = tokio::time::interval(Duration::from_millis(33));
        for tick in 101u64.. {
            ticks.tick().await;
            for slot in SLOT..SLOT + slots {
                let dof = fake_server::car(10 * u32::from(slot), tick, (tick - 100) as f64 * f64::from(step));
                let ack = ack((tick - 101) as u32, tick);
                let snapshot = Snapshot { epoch: EPOCH, tick, ack, event_sequence: EVENTS_BEFORE, cells: None, dof };
                let key = format!("pita/{}/snapshot/{slot}", fake_server::ARENA);
                fake_server::put(&server.zenoh, key, encode(&snapshot)).await;
            }
        }
    })
}

#[tokio::test(flavor = "multi_thread")]
async fn a_fleet_drives_and_counts() {
    let server = Arc::new(FakeServer::start().await);
    let world = run_world(Arc::clone(&server), 3, 0.3);
    let mut fleet = fleet(&server);
    soon("joining", fleet.add(2)).await.unwrap();
    soon("joining", fleet.add(1)).await.unwrap();
    assert_eq!((fleet.len(), fleet.running()), (3, 3));

    let before = fleet.tally();
    let began = Instant::now();
    let mut inputs = HashSet::new();
    let interval = loop {
        inputs.insert(server.input().await.frames.last().unwrap().sequence);
        let interval = fleet.tally().since(&before);
        let total = interval.total();
        // 30 cm a tick for about 30 ticks.
        if inputs.len() > 30 && total.distance_min_m() > 8.0 && total.lateness_us.len() > 90 {
            break interval;
        }
        assert!(began.elapsed() < SOON, "{} distinct inputs, {total:?}", inputs.len());
    };
    let total = interval.total();
    assert_eq!((total.connected, total.lost.len()), (3, 0));
    assert_eq!(interval.scripts[&ScriptKind::Circle].connected, 2);
    assert!(!total.session.latency_us.is_empty());

    let stopping = tokio::spawn(fleet.stop());
    server.all_leave(3).await;
    let last = soon("stopping", stopping).await.unwrap();
    assert!(last.total().session.snapshots_received > total.session.snapshots_received);
    world.abort();
}

#[tokio::test(flavor = "multi_thread")]
async fn a_full_server_ends_the_growth_and_keeps_who_is_in() {
    let joined = std::sync::atomic::AtomicU16::new(0);
    let server = FakeServer::answering(Box::new(move |_| {
        let number = joined.fetch_add(1, std::sync::atomic::Ordering::Relaxed);
        let full = || encode(&JoinReply::Refused(Refusal::Full { slots: 2 }));
        Some(if number < 2 { fake_server::accept(SLOT + number, Role::Player) } else { full() })
    }))
    .await;
    let mut fleet = fleet(&server);
    let grown = soon("joining", fleet.add(4)).await;
    assert_eq!(grown, Err(ClientError::Refused(Refusal::Full { slots: 2 })));
    assert_eq!(fleet.len(), 2);
}

#[tokio::test(flavor = "multi_thread")]
async fn a_player_without_a_vehicle_is_an_error() {
    let server = FakeServer::answering(Box::new(|_| Some(fake_server::accept(SLOT, Role::Spectator)))).await;
    let mut fleet = fleet(&server);
    assert_eq!(soon("joining", fleet.add(1)).await, Err(ClientError::NoActor));
    assert!(fleet.is_empty());
}

#[tokio::test(flavor = "multi_thread")]
async fn bots_whose_server_is_silent_are_lost() {
    let server = FakeServer::start().await;
    let mut fleet = BotFleet::new(FleetSettings { loss_timeout: Duration::from_secs(1), ..settings(&server) });
    soon("joining", fleet.add(2)).await.unwrap();
    let gone = async {
        while fleet.running() > 0 {
            tokio::time::sleep(Duration::from_millis(50)).await;
        }
    };
    soon("the loss", gone).await;
    assert_eq!(fleet.tally().total().lost.len(), 2);
}
