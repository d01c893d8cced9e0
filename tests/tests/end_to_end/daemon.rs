//! The daemon as a person meets it: start, stop, subcommands, errors.

use std::path::Path;
use std::process::Command;

use pita_client::SessionEvent;
use pita_game::Arena;
use pita_protocol::message::Event;
use pita_tests::process::Signal;

use crate::clients::connect;
use crate::run::{Ended, free_port, run};
use crate::{SOON, observed, pita_server, start_server};

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn it_says_how_it_does() {
    let (server, observer) = start_server().await;
    let status = observer.status().await.unwrap();
    assert_eq!((status.tick_hz, status.clients), (30, 0), "{status:?}");
    assert!(status.version.contains(env!("CARGO_PKG_VERSION")), "{status:?}");
    server.stop().unwrap_or_else(|error| panic!("{error}"));
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_taken_port_is_said_and_fails() {
    let (server, _observer) = start_server().await;
    let Ended { success, said } = run(pita_server().args(["run", "--listen", &server.endpoint]));
    assert!(!success, "{said}");
    let port = server.endpoint.rsplit(':').next().unwrap();
    assert!(said.contains(port) && said.contains("in use"), "{said}");
    assert!(said.contains("--listen"), "what to do next is missing: {said}");
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn signals_end_it_in_order_and_clients_are_told() {
    for signal in [Signal::TERM, Signal::INT] {
        let (mut server, _observer) = start_server().await;
        let session = connect(&server.endpoint, "ann").await;
        server.process.signal(signal).unwrap();
        let told = tokio::time::timeout(SOON, async {
            loop {
                match session.next_event().await {
                    Some(SessionEvent::Happened(Event::Closing { reason })) => return Some(reason),
                    Some(_) => {}
                    None => return None,
                }
            }
        });
        let reason = told.await.expect("told in time").expect("told before the session ended");
        assert!(!reason.is_empty());
        server.process.wait_for_success(SOON).unwrap_or_else(|error| panic!("{signal:?}: {error}"));
    }
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn status_asks_a_running_server() {
    let (server, _observer) = start_server().await;
    let Ended { success, said } = run(pita_server().args(["status", "--connect", &server.endpoint]));
    assert!(success, "{said}");
    assert!(said.contains("tick") && said.contains("clients"), "{said}");
    server.stop().unwrap_or_else(|error| panic!("{error}"));
}

#[test]
fn status_of_no_server_fails_and_says_what_to_do() {
    let endpoint = format!("tcp/127.0.0.1:{}", free_port());
    let Ended { success, said } = run(pita_server().args(["status", "--connect", &endpoint]));
    assert!(!success, "{said}");
    assert!(said.contains(&endpoint) && said.contains("cargo run --release"), "{said}");
}

#[test]
fn check_accepts_the_defaults_from_any_folder() {
    let folder = tempfile::tempdir().unwrap();
    let Ended { success, said } = run(pita_server().arg("check").current_dir(folder.path()));
    assert!(success, "{}", said);
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn it_runs_in_any_folder_and_at_25_hz() {
    let folder = tempfile::tempdir().unwrap();
    let mut command = pita_server();
    let (server, observer) = observed(command.args(["run", "--tick-hz", "25"]).current_dir(folder.path())).await;
    assert_eq!(observer.status().await.unwrap().tick_hz, 25);
    server.stop().unwrap_or_else(|error| panic!("{error}"));
    assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 0, "it left files");
}

#[test]
fn a_bad_configuration_is_named_by_check_and_run() {
    let folder = tempfile::tempdir().unwrap();
    for (text, words) in [
        ("[tick]\ntick_hz = 31\n", &["tick_hz", "31", "30 or 25"][..]),
        ("[sessions]\nplayers_max = 0\n", &["sessions.players_max", "0", "1 to 1024"]),
        ("[network]\nlisten = 'over there'\n", &["network.listen", "over there", "tcp/"]),
        ("[tick\n", &["line 1"]),
    ] {
        let file = written(folder.path(), "bad.toml", text);
        for arguments in [vec!["check", &file], vec!["run", "--config", &file]] {
            assert_named(pita_server().args(arguments), &file, words);
        }
    }
    let missing = folder.path().join("missing.toml").display().to_string();
    assert_named(pita_server().args(["check", &missing]), &missing, &["No such file"]);
}

#[test]
fn a_bad_arena_is_named_by_check_and_run() {
    let folder = tempfile::tempdir().unwrap();
    let heavy = Arena::DEFAULT.replacen("gravity = 9.81", "gravity = 981", 1);
    let file = written(folder.path(), "heavy.toml", &heavy);
    let words = ["gravity", "981", "0 to 100"];
    assert_named(pita_server().args(["check", &file]), &file, &words);
    assert_named(pita_server().args(["run", "--arena", &file]), &file, &words);
    assert_named(pita_server().args(["run", "--arena", "atlantis"]), "atlantis", &["proving-ground"]);
}

#[test]
fn every_binary_prints_version_and_commit() {
    for binary in [
        env!("CARGO_BIN_EXE_pita-test-server"),
        env!("CARGO_BIN_EXE_pita-loadtest"),
        env!("CARGO_BIN_EXE_pita-bench"),
        env!("CARGO_BIN_EXE_pita-yardstick"),
    ] {
        let Ended { success, said } = run(Command::new(binary).arg("--version"));
        assert!(success && said.contains(env!("CARGO_PKG_VERSION")) && said.contains('('), "{said}");
    }
}

/// The command has to fail, naming the file, and in it what is wrong.
fn assert_named(command: &mut Command, file: &str, words: &[&str]) {
    let ended = run(command);
    assert!(!ended.success, "{command:?} did not fail: {}", ended.said);
    for word in words.iter().chain([&file]) {
        assert!(ended.said.contains(word), "{command:?} does not name {word:?}: {}", ended.said);
    }
}

/// A ball in free fall for three ticks: the trace holds its velocity, and is the same twice.
#[test]
fn simulate_runs_a_scene_and_leaves_its_trace() {
    let folder = tempfile::tempdir().unwrap();
    let ball = "body sphere 0.5 0 0 1 0.1 0.1 0.1 0 2 0 1 0 0 0 0 0 0 0 0 0 0.5 1";
    let scene = written(folder.path(), "ball.scene", &format!("ticks 3\ngravity 0 -9 0\n{ball}\n"));
    let simulate = |name: &str| {
        let out = folder.path().join(name);
        let Ended { success, said } = run(pita_server().args(["simulate", &scene, "--json", "--out"]).arg(&out));
        assert!(success, "{said}");
        let numbers = |extension| {
            let bytes = std::fs::read(out.with_extension(extension)).unwrap();
            bytes.chunks_exact(8).map(|b| f64::from_le_bytes(b.try_into().unwrap())).collect::<Vec<_>>()
        };
        (numbers("tr"), numbers("ms").len())
    };
    let (states, times) = simulate("a");
    assert_eq!((states.len(), times), (4 * 13, 3 * 2));
    assert!((states[3 * 13 + 8] + 9.0 * 3.0 / 30.0).abs() < 1e-9, "{states:?}");
    assert_eq!(simulate("b").0, states);
}

#[test]
fn simulate_names_what_is_wrong() {
    let folder = tempfile::tempdir().unwrap();
    let scene = written(folder.path(), "bad.scene", "ticks 3\nbody teapot\n");
    assert_named(pita_server().args(["simulate", &scene]), "bad.scene", &["line 2", "body takes 22 numbers"]);
    let missing = folder.path().join("missing").join("out").display().to_string();
    assert_named(pita_server().args(["simulate", "proving-ground", "--ticks", "2", "--out", &missing]), "out.tr", &[]);
}

fn written(folder: &Path, name: &str, text: &str) -> String {
    let file = folder.join(name);
    std::fs::write(&file, text).unwrap();
    file.display().to_string()
}
