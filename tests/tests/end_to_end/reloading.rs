//! A running daemon reads its arena's file again: on SIGHUP, and for who knows its secret; players stay.

use std::path::Path;

use pita_tests::observer::Observer;
use pita_tests::process::Signal;

use crate::clients::connect;
use crate::run::{Ended, run};
use crate::{await_clients, eventually, observed, pita_server};

/// Flat ground with so many crates.
fn arena(crates: usize) -> String {
    let flat = include_str!("../../../configs/arenas/flat.toml");
    let place = "kind = \"crate\"\nmaterial = \"asphalt\"\nposition = [60.0, 0.0, 60.0]\nspacing = [2.0, 0.0, 0.0]";
    format!("{flat}\n[[actors]]\n{place}\ncopies = [{crates}, 1, 1]\n")
}

/// Waits until so many crates act.
async fn await_crates(observer: &Observer, crates: u32) {
    eventually(&format!("{crates} crates"), async || {
        let status = observer.status().await.unwrap_or_else(|error| panic!("{error}"));
        let acting = status.kinds.iter().find(|kind| kind.kind == "crate").map(|kind| kind.actors);
        (acting == Some(crates)).then_some(())
    })
    .await;
}

/// `pita-server reload` with a secret.
fn reload(endpoint: &str, secret: &Path) -> Ended {
    run(pita_server().args(["reload", "--connect", endpoint, "--secret-file"]).arg(secret))
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_file_is_read_again_on_demand_and_on_a_signal() {
    let folder = tempfile::tempdir().unwrap();
    let [file, secret, wrong, config] =
        ["arena.toml", "secret", "wrong", "server.toml"].map(|name| folder.path().join(name));
    std::fs::write(&file, arena(1)).unwrap();
    std::fs::write(&secret, "a secret of this test\n").unwrap();
    std::fs::write(&wrong, "a secret of another test\n").unwrap();
    let text = format!("[arena]\nsource = {file:?}\n[admin]\nsecret_file = {secret:?}\n");
    std::fs::write(&config, text).unwrap();
    let (server, observer) = observed(pita_server().arg("run").arg("--config").arg(&config)).await;
    let session = connect(&server.endpoint, "ann").await;
    await_crates(&observer, 1).await;

    std::fs::write(&file, arena(3)).unwrap();
    let Ended { success, said } = reload(&server.endpoint, &wrong);
    assert!(!success && said.contains("same secret"), "{said}");
    let Ended { success, said } = reload(&server.endpoint, &secret);
    assert!(success && said.contains("actors"), "{said}");
    await_crates(&observer, 3).await;

    std::fs::write(&file, arena(3).replace("friction = 1.0", "friction = 0.5")).unwrap();
    let Ended { success, said } = reload(&server.endpoint, &secret);
    assert!(!success && said.contains("materials cannot change"), "{said}");
    std::fs::write(&file, "name = ").unwrap();
    let Ended { success, said } = reload(&server.endpoint, &secret);
    assert!(!success && said.contains("goes on as it is") && said.contains("arena.toml"), "{said}");

    std::fs::write(&file, arena(2)).unwrap();
    server.process.signal(Signal::HUP).unwrap();
    await_crates(&observer, 2).await;
    await_clients(&observer, 1).await;
    drop(session);
    server.stop().unwrap_or_else(|error| panic!("{error}"));
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn without_a_secret_nobody_may_ask() {
    let folder = tempfile::tempdir().unwrap();
    let secret = folder.path().join("secret");
    std::fs::write(&secret, "a secret that nobody gave the server").unwrap();
    let (server, _observer) = crate::start_server().await;
    let Ended { success, said } = reload(&server.endpoint, &secret);
    assert!(!success && said.contains("admin.secret_file"), "{said}");
    server.stop().unwrap_or_else(|error| panic!("{error}"));
}
