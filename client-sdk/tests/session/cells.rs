//! Cells as a server grants and puts them.

use std::time::Duration;

use pita_protocol::{
    Keys,
    message::{CellGrant, CellId, Snapshot},
};

use crate::{
    fake_server::{ARENA, FakeServer, snapshot},
    player, soon,
};

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_cell_that_says_nothing_is_subscribed_to_anew() {
    let server = FakeServer::start().await;
    let cell = CellId { x: 0, z: 0 };
    let publisher = server.zenoh.declare_publisher(Keys::new(ARENA).unwrap().cell(cell, 0)).await.unwrap();
    let matching = publisher.matching_listener().await.unwrap();
    let session = player(&server).await;
    let grant = async {
        for tick in 102.. {
            server.put_snapshot(Snapshot { cells: Some(vec![CellGrant { cell, layers: 1 }]), ..snapshot(tick) }).await;
            tokio::time::sleep(Duration::from_millis(5)).await;
        }
    };
    let anew = async {
        for is_subscribed in [true, false, true] {
            while matching.recv_async().await.expect("it listens").matching() != is_subscribed {}
        }
    };
    tokio::select! {
        () = grant => unreachable!("ticks do not end"),
        () = soon("a second subscription", anew) => {}
    }
    let counts = session.statistics();
    assert!(counts.cells_fallen_silent > 0 && counts.malformed == 0, "{counts:?}");
}
