//! `pita-bots` as a process: what it says, and its exit code.

use std::{
    process::{Child, Command, Output, Stdio},
    sync::Arc,
};

use pita_client::Event;
use rustix::process::{Pid, Signal, kill_process};
use serde_json::Value;

use crate::{
    bots::run_world,
    fake_server::{EVENTS_BEFORE, FakeServer},
    soon,
};

fn start(endpoint: &str, arguments: &[&str]) -> Child {
    Command::new(env!("CARGO_BIN_EXE_pita-bots"))
        .args(["--connect", endpoint, "--json"])
        .args(arguments)
        .stdin(Stdio::null())
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap()
}

async fn finish(bots: Child) -> Output {
    soon("the end of pita-bots", tokio::task::spawn_blocking(|| bots.wait_with_output())).await.unwrap().unwrap()
}

fn said(output: &Output) -> String {
    String::from_utf8_lossy(&output.stderr).into_owned()
}

fn figures(output: &Output) -> Value {
    serde_json::from_slice(&output.stdout).unwrap_or_else(|error| panic!("{error}: {output:?}"))
}

#[test]
fn prints_version_and_commit() {
    let output = Command::new(env!("CARGO_BIN_EXE_pita-bots")).arg("--version").output().unwrap();
    let said = String::from_utf8_lossy(&output.stdout).into_owned();
    assert!(said.starts_with("pita-bots ") && said.contains(env!("CARGO_PKG_VERSION")) && said.contains('('), "{said}");
}

#[tokio::test(flavor = "multi_thread")]
async fn says_that_nobody_answers_and_gives_up() {
    let server = FakeServer::start().await;
    let endpoint = server.endpoint.clone();
    server.zenoh.close().await.unwrap();
    drop(server);
    let output = finish(start(&endpoint, &["--wait", "1"])).await;
    assert_eq!(output.status.code(), Some(1));
    let said = said(&output);
    for words in ["no server answers at tcp/127.0.0.1", "cargo run --release", "waiting for it"] {
        assert!(said.contains(words), "{said}");
    }
}

#[tokio::test(flavor = "multi_thread")]
async fn a_good_run_succeeds_and_prints_its_figures() {
    let server = Arc::new(FakeServer::start().await);
    let world = run_world(Arc::clone(&server), 3, 0.3);
    let bots = start(&server.endpoint, &["--count", "3", "--script", "circle,chase", "--seconds", "4"]);
    let output = finish(bots).await;
    world.abort();
    assert!(output.status.success(), "{}", said(&output));
    let figures = figures(&output);
    assert_eq!(figures["ok"], true);
    let all = &figures["scripts"]["all"];
    assert_eq!((&all["bots_connected"], &all["bots_lost"]), (&3.into(), &0.into()));
    assert_eq!(figures["scripts"]["circle"]["bots_connected"], 2);
    // A small part of what four seconds bring on a machine that does nothing else: 36 m, 360 snapshots.
    for (key, least) in [
        ("distance_min_m", 3.0),
        ("snapshots_received", 30.0),
        ("received_bytes_per_s", 100.0),
        ("sent_bytes_per_s", 100.0),
        ("input_to_effect_p50_ms", 0.0),
        ("bots_late_p99_ms", 0.0),
    ] {
        assert!(all[key].as_f64().is_some_and(|figure| figure >= least), "{key}: {}", all[key]);
    }
}

/// Everything that a bad network can do, on a command line: what is lost is missed, what comes twice is stale, what a freeze
/// holds up comes late, and nothing of it ends a session.
#[tokio::test(flavor = "multi_thread")]
async fn bots_drive_over_every_kind_of_a_bad_network() {
    let server = Arc::new(FakeServer::start().await);
    let world = run_world(Arc::clone(&server), 1, 0.3);
    let conditions =
        "latency=40,jitter=10,loss=10,duplicate=20,reorder=20,up.rate=20000,down.rate=100000,freeze=2/0.3,seed=7";
    let bots = start(&server.endpoint, &["--count", "1", "--seconds", "5", "--conditioner", conditions]);
    let output = finish(bots).await;
    world.abort();
    assert!(output.status.success(), "{}", said(&output));
    let all = &figures(&output)["scripts"]["all"];
    assert_eq!((&all["bots_lost"], &all["malformed"]), (&0.into(), &0.into()), "{all}");
    for (key, least) in [
        ("distance_min_m", 3.0),
        ("snapshots_received", 30.0),
        ("snapshots_missed", 3.0),
        ("snapshots_stale", 3.0),
        ("jitter_p99_ms", 100.0),
    ] {
        assert!(all[key].as_f64().is_some_and(|figure| figure >= least), "{key}: {all}");
    }
}

#[tokio::test(flavor = "multi_thread")]
async fn cars_that_stand_still_fail_the_run() {
    let server = Arc::new(FakeServer::start().await);
    let world = run_world(Arc::clone(&server), 1, 0.0);
    let output = finish(start(&server.endpoint, &["--count", "1", "--seconds", "1"])).await;
    world.abort();
    assert_eq!(output.status.code(), Some(1));
    assert!(said(&output).contains("1 of 1 cars went nowhere"), "{}", said(&output));
    assert_eq!(figures(&output)["ok"], false);
}

#[tokio::test(flavor = "multi_thread")]
async fn a_server_that_closes_fails_the_run_at_once() {
    let server = Arc::new(FakeServer::start().await);
    let world = run_world(Arc::clone(&server), 1, 0.3);
    let bots = start(&server.endpoint, &["--count", "1", "--seconds", "600"]);
    server.input().await;
    server.put_event(EVENTS_BEFORE + 1, Event::Closing { reason: "maintenance".into() }).await;
    let output = finish(bots).await;
    world.abort();
    assert_eq!(output.status.code(), Some(1));
    assert!(said(&output).contains("1 of 1 bots lost: the server closed (maintenance)"), "{}", said(&output));
}

#[tokio::test(flavor = "multi_thread")]
async fn an_interrupt_lets_the_bots_leave() {
    let server = Arc::new(FakeServer::start().await);
    let world = run_world(Arc::clone(&server), 2, 0.3);
    let bots = start(&server.endpoint, &["--count", "2", "--seconds", "600"]);
    while server.input().await.frames.last().unwrap().sequence < 30 {}
    kill_process(Pid::from_child(&bots), Signal::INT).unwrap();
    server.all_leave(2).await;
    let output = finish(bots).await;
    world.abort();
    assert!(output.status.success(), "{}", said(&output));
    assert_eq!(figures(&output)["scripts"]["all"]["bots_connected"], 2);
}
