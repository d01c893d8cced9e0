//! The programs of this package, run as a person would.

use std::process::Command;

use pita_tests::process::{Pid, Process, Signal};
use rustix::process::kill_process;
use serde_json::Value;

use crate::run::{Ended, free_port, run};
use crate::{LONG, await_clients, eventually, start_configured, start_server};

#[test]
fn a_short_load_test_measures_each_step_and_leaves_its_figures() {
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("new").join("folder");
    let json = folder.path().join("figures.json");
    let mut command = load_test();
    command.args(["--clients", "1,3", "--ticks", "30"]).arg("--out").arg(&out).arg("--json").arg(&json);
    let Ended { success, said } = run(&mut command);
    assert!(success, "{said}");
    assert!(said.contains("up to 3 clients") || said.contains("first passes"), "{said}");
    assert!(out.join("tick-time.svg").is_file(), "{said}");

    let figures: Value = serde_json::from_str(&std::fs::read_to_string(json).unwrap()).unwrap();
    let steps = figures["steps"].as_array().unwrap();
    let column = |name: &str| steps.iter().map(|step| step[name].as_u64().unwrap()).collect::<Vec<_>>();
    assert_eq!(column("clients"), [1, 3]);
    for step in steps {
        assert_eq!(step["ticks"]["ticks"], 30, "{step}");
        for positive in ["/ticks/tick/p50_ms", "/ticks/cpu/p50_ms", "/server_cpu_cores", "/server_memory_bytes"] {
            assert!(step.pointer(positive).and_then(Value::as_f64).is_some_and(|x| x > 0.0), "{positive}: {step}");
        }
        assert!(step["bots"]["snapshots"].as_u64().unwrap() > 0 && step["bots"]["lost"] == 0, "{step}");
    }
    let bodies: Vec<_> = steps.iter().map(|step| step["ticks"]["bodies"].as_u64().unwrap()).collect();
    assert!(bodies[1] > bodies[0], "two more cars have more bodies: {bodies:?}");
}

/// A limit that no tick keeps: one server after the other is asked for fewer cars of its own, and the arena has them.
#[test]
fn the_load_test_finds_out_how_many_vehicles_go() {
    let folder = tempfile::tempdir().unwrap();
    let json = folder.path().join("figures.json");
    let mut command = load_test();
    command.args(["--arena", "desert-town", "--vehicles", "5", "--until", "0.01", "--ticks", "30"]);
    command.arg("--out").arg(folder.path()).arg("--json").arg(&json).args(["--", "--threads", "2"]);
    let Ended { success, said } = run(&mut command);
    assert!(success && said.contains("p99 was within 0.01 ms at no number of vehicles that was tried"), "{said}");

    let figures: Value = serde_json::from_str(&std::fs::read_to_string(json).unwrap()).unwrap();
    let steps = figures["steps"].as_array().unwrap();
    let counts: Vec<_> = steps.iter().map(|step| step["count"].as_u64().unwrap()).collect();
    assert_eq!(counts, [5, 2, 1]);
    assert!(figures["within_until"].is_null() && steps.iter().all(|step| step["clients"] == 1), "{figures}");
    let bodies = |step: usize| steps[step]["ticks"]["bodies"].as_u64().unwrap();
    assert!(bodies(0) > bodies(2), "four more cars have more bodies: {} and {}", bodies(0), bodies(2));
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn the_load_test_measures_a_running_server_and_leaves_it_running() {
    let (server, observer) = start_server().await;
    let folder = tempfile::tempdir().unwrap();
    let mut command = load_test();
    command.args(["--connect", &server.endpoint, "--clients", "2", "--ticks", "30", "--json", "-"]);
    let Ended { success, said } = run(command.arg("--out").arg(folder.path()));
    assert!(success && said.contains("\"server_cores\": null"), "{said}");
    assert_eq!(observer.status().await.unwrap().clients, 0);
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_lost_client_fails_the_load_test_after_its_report() {
    // Within a grace time a bot's connection would come back and its session go on.
    let (server, observer) = start_configured("[sessions]\nresume_grace_ms = 0\n").await;
    let folder = tempfile::tempdir().unwrap();
    let mut command = load_test();
    command.args(["--connect", &server.endpoint, "--clients", "2", "--ticks", "200"]).arg("--out").arg(folder.path());
    let mut process = Process::start("the load test", &mut command).unwrap();
    await_clients(&observer, 2).await;
    let joined = observer.status().await.unwrap().tick;
    eventually("both to drive for a second", async || {
        (observer.status().await.unwrap().tick > joined + 30).then_some(())
    })
    .await;

    let bots = only_child_of(&process);
    kill_process(bots, Signal::STOP).unwrap();
    await_clients(&observer, 0).await;
    kill_process(bots, Signal::CONT).unwrap();

    let status = process.wait(LONG).unwrap();
    let said = process.output();
    assert!(!status.success() && said.contains("2 clients were lost"), "{status}: {said}");
}

fn only_child_of(process: &Process) -> Pid {
    let pid = process.pid();
    let children = std::fs::read_to_string(format!("/proc/{pid}/task/{pid}/children")).unwrap();
    children.trim().parse().ok().and_then(Pid::from_raw).unwrap_or_else(|| panic!("not one child: {children:?}"))
}

#[test]
fn the_load_test_says_what_it_cannot_do() {
    let nobody = format!("tcp/127.0.0.1:{}", free_port());
    for (arguments, words) in [
        (&["--connect", &nobody][..], &[nobody.as_str(), "cargo run --release"][..]),
        (&["--clients", "0"], &["--clients", "1..=1000"]),
        (&["--cores", "5000"], &["--cores", "5000"]),
        (&["--until", "0"], &["--until", "0.01 to 10000 ms"]),
        (&["--clients", "1,2", "--vehicles", "3"], &["--clients [1, 2]", "one number"]),
        (&["--vehicles", "3", "--arena", "stress"], &["parameters is drivers", "one of size"]),
        (&["--arena", "atlantis"], &["atlantis", "proving-ground"]),
    ] {
        let Ended { success, said } = run(load_test().args(arguments));
        assert!(!success, "{arguments:?}: {said}");
        for word in words {
            assert!(said.contains(word), "{arguments:?} does not name {word:?}: {said}");
        }
    }
}

#[test]
fn measurements_are_listed_and_a_wrong_name_is_refused() {
    let Ended { success, said } = run(bench().arg("list"));
    assert!(success && said.contains("measures"), "{said}");
    let Ended { success, said } = run(bench().arg("tik"));
    assert!(!success && said.contains("no measurement is called 'tik'"), "{said}");
}

#[test]
fn peers_are_run_and_judged_scene_by_scene() {
    let Ended { success, said } =
        run(bench().args(["peers", "--scenes", "slope45,stack10", "--rounds", "1", "--json"]));
    assert!(success && said.contains("cheapest accepted peer"), "{said}");
    let figures: Value = serde_json::from_str(said.lines().find(|line| line.starts_with('{')).unwrap()).unwrap();
    for scene in ["slope45", "stack10"] {
        let scene = &figures["figures"]["peers"][scene];
        assert_eq!(scene["pita"]["accepted"], true, "{scene}");
        assert_eq!(scene["rapier"][0]["accepted"], false, "at its defaults: {scene}");
        assert_eq!(scene["rapier"][1]["accepted"], true, "at its accepted setting: {scene}");
        assert!(scene["p50_ratio"].as_f64().unwrap() > 0.0, "{scene}");
    }
    let Ended { success, said } = run(bench().args(["peers", "--scenes", "slope54"]));
    assert!(!success && said.contains("no scene 'slope54'; there are: pile100,"), "{said}");
}

#[test]
fn the_yardsticks_beam_leaves_its_trace() {
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("beam");
    let mut yardstick = Command::new(env!("CARGO_BIN_EXE_pita-yardstick"));
    let Ended { success, said } = run(yardstick.args(["soft", "1", "default"]).arg(&out));
    assert!(success, "{said}");
    let size = |extension: &str| std::fs::metadata(out.with_extension(extension)).unwrap().len();
    // 10 s of 11 by 3 by 3 nodes, of which the 3 by 3 clamped ones are no DOF.
    assert_eq!((size("tr"), size("ms")), (301 * 90 * 13 * 8, 300 * 2 * 8));
}

fn load_test() -> Command {
    Command::new(env!("CARGO_BIN_EXE_pita-loadtest"))
}

fn bench() -> Command {
    Command::new(env!("CARGO_BIN_EXE_pita-bench"))
}
