//! Snapshots as datagrams, through a relay that counts, loses and falls silent.

use std::collections::HashMap;
use std::net::{SocketAddr, UdpSocket};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::time::Duration;

use pita_client::{ClientError, Session};
use pita_protocol::{
    decode, encode,
    message::{CellGrant, CellId, CellSnapshot, JoinRequest, Snapshot},
};

use crate::{
    builder,
    fake_server::{FakeServer, SLOT, accept, car, snapshot},
    soon,
};

/// Carries datagrams between one client and a server.
struct Relay {
    endpoint: String,
    /// Bytes that came from the server.
    down: Arc<AtomicU64>,
    /// Whether it lets nothing through.
    is_silent: Arc<AtomicBool>,
    has_ended: Arc<AtomicBool>,
}

impl Relay {
    /// To `server`; loses every `lost`-th datagram of the server, none for 0.
    fn start(server: SocketAddr, lost: u64) -> Self {
        let near = Arc::new(UdpSocket::bind("127.0.0.1:0").unwrap());
        let endpoint = format!("udp/{}", near.local_addr().unwrap());
        let relay = Self { endpoint, down: Arc::default(), is_silent: Arc::default(), has_ended: Arc::default() };
        let (down, is_silent, has_ended) = (relay.down.clone(), relay.is_silent.clone(), relay.has_ended.clone());
        near.set_read_timeout(Some(Duration::from_millis(50))).unwrap();
        std::thread::spawn(move || {
            let mut ways: HashMap<SocketAddr, Arc<UdpSocket>> = HashMap::new();
            let mut datagram = vec![0; 65_536];
            while !has_ended.load(Ordering::Relaxed) {
                let Ok((len, client)) = near.recv_from(&mut datagram) else { continue };
                let far = ways.entry(client).or_insert_with(|| {
                    let far = Arc::new(UdpSocket::bind("127.0.0.1:0").unwrap());
                    far.connect(server).unwrap();
                    far.set_read_timeout(Some(Duration::from_millis(50))).unwrap();
                    let (near, down) = (near.clone(), down.clone());
                    let (is_silent, has_ended, from) = (is_silent.clone(), has_ended.clone(), far.clone());
                    std::thread::spawn(move || {
                        let (mut datagram, mut count) = (vec![0; 65_536], 0u64);
                        while !has_ended.load(Ordering::Relaxed) {
                            let Ok(len) = from.recv(&mut datagram) else { continue };
                            count += 1;
                            let is_lost = lost > 0 && count.is_multiple_of(lost);
                            if !is_lost && !is_silent.load(Ordering::Relaxed) {
                                down.fetch_add(len as u64, Ordering::Relaxed);
                                let _ = near.send_to(&datagram[..len], client);
                            }
                        }
                    });
                    far
                });
                if !is_silent.load(Ordering::Relaxed) {
                    let _ = far.send(&datagram[..len]);
                }
            }
        });
        relay
    }

    fn down(&self) -> u64 {
        self.down.load(Ordering::Relaxed)
    }
}

impl Drop for Relay {
    fn drop(&mut self) {
        self.has_ended.store(true, Ordering::Relaxed);
    }
}

/// Puts a snapshot every 20 ms for as long as `play` lasts.
async fn during<T>(server: &FakeServer, play: impl Future<Output = T>) -> T {
    let put = async {
        for tick in 101.. {
            server.put_snapshot(snapshot(tick)).await;
            tokio::time::sleep(Duration::from_millis(20)).await;
        }
    };
    tokio::select! {
        played = play => played,
        () = put => unreachable!("ticks do not end"),
    }
}

/// Ticks of the next `count` snapshots.
async fn ticks(session: &Session, count: usize) -> Vec<u64> {
    let mut ticks = Vec::new();
    while ticks.len() < count {
        ticks.push(soon("a snapshot", session.next_snapshot()).await.unwrap().tick());
    }
    ticks
}

#[tokio::test(flavor = "multi_thread")]
async fn snapshots_come_as_datagrams_some_of_which_are_lost() {
    let server = FakeServer::start().await;
    let relay = Relay::start(server.datagrams, 10);
    let session = builder(&server).datagrams(&relay.endpoint).connect().await.unwrap();
    let (before, ticks) = during(&server, async {
        ticks(&session, 1).await;
        (relay.down(), ticks(&session, 60).await)
    })
    .await;
    assert!(relay.down() > before + 60 * 20, "{} bytes in datagrams", relay.down() - before);
    // What is lost is not repeated and holds up nothing.
    assert!(ticks.is_sorted() && ticks[59] >= ticks[0] + 62, "{ticks:?}");
}

#[tokio::test(flavor = "multi_thread")]
async fn cells_come_along_as_datagrams_and_need_no_subscription() {
    const NEIGHBOUR: u32 = 990;
    let wishes = Arc::new(AtomicBool::new(false));
    let of_joins = Arc::clone(&wishes);
    let server = FakeServer::answering(Box::new(move |request| {
        let request: JoinRequest = decode(request).expect("the client's request");
        of_joins.store(request.cells_along, Ordering::Relaxed);
        Some(accept(SLOT, request.role))
    }))
    .await;
    let relay = Relay::start(server.datagrams, 5);
    let session = builder(&server).datagrams(&relay.endpoint).connect().await.unwrap();
    assert!(wishes.load(Ordering::Relaxed), "cells are to come along");
    let cell = CellId { x: 0, z: 0 };
    let put = async {
        for tick in 101.. {
            let dof = car(NEIGHBOUR, tick, 5.0);
            let of_cell = CellSnapshot { cell, tick, keyframe_age: 0, departures: Vec::new(), dof };
            server.put_on_snapshot(encode(&of_cell)).await;
            server.put_snapshot(Snapshot { cells: Some(vec![CellGrant { cell, layers: 1 }]), ..snapshot(tick) }).await;
            tokio::time::sleep(Duration::from_millis(20)).await;
        }
    };
    let see = async {
        loop {
            let snapshot = soon("a snapshot", session.next_snapshot()).await.unwrap();
            if snapshot.slices().iter().any(|slice| slice.id == NEIGHBOUR) {
                break;
            }
        }
    };
    tokio::select! {
        () = soon("a body of the cell", see) => {}
        () = put => unreachable!("ticks do not end"),
    }
    assert!(session.statistics().cells_received > 0 && session.statistics().malformed == 0);
}

#[tokio::test(flavor = "multi_thread")]
async fn where_datagrams_stop_snapshots_come_over_the_first_connection() {
    let server = FakeServer::start().await;
    let relay = Relay::start(server.datagrams, 0);
    let session = builder(&server).datagrams(&relay.endpoint).connect().await.unwrap();
    during(&server, async {
        ticks(&session, 30).await;
        relay.is_silent.store(true, Ordering::Relaxed);
        let before = relay.down();
        let later = ticks(&session, 60).await;
        assert!(later.is_sorted() && relay.down() <= before + 2000, "{later:?}");
    })
    .await;
}

#[tokio::test(flavor = "multi_thread")]
async fn who_gets_no_datagrams_at_all_plays_on_without() {
    let server = FakeServer::start().await;
    let relay = Relay::start(server.datagrams, 0);
    relay.is_silent.store(true, Ordering::Relaxed);
    let builder = builder(&server).datagrams(&relay.endpoint).connect_timeout(Duration::from_secs(3));
    let session = builder.connect().await.unwrap();
    during(&server, ticks(&session, 30)).await;
    assert_eq!(relay.down(), 0);
}

#[tokio::test(flavor = "multi_thread")]
async fn endpoints_that_were_mixed_up_are_refused_by_name() {
    let connect = |control: &str, datagrams: &str| Session::builder(control, "Wu").datagrams(datagrams).connect();
    let tcp = "tcp/127.0.0.1:9".to_owned();
    assert_eq!(connect(&tcp, &tcp).await.unwrap_err(), ClientError::Datagrams(tcp));
    let udp = "udp/127.0.0.1:9".to_owned();
    assert_eq!(connect(&udp, &udp).await.unwrap_err(), ClientError::Control(udp));
}
