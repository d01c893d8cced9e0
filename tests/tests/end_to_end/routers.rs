//! Clients behind one and two Zenoh routers play like those that are connected directly.

use std::net::TcpListener;

use pita_client::{Event, SessionEvent};

use crate::clients::{ahead, connect, ground_distance, next_snapshot, position};
use crate::{SOON, await_clients, start_patient_server, start_server};

/// How far a car has to get, m.
const FAR: f32 = 3.0;
/// Players behind one router, and how often all of them send at once.
const CROWD: usize = 12;
const ROUNDS: usize = 10;
/// Snapshots until an input counts as lost.
const PATIENCE: usize = 15;

/// A router that connects to `upstream`, and where it listens.
async fn router(upstream: &str) -> (zenoh::Session, String) {
    let port = TcpListener::bind("127.0.0.1:0").unwrap().local_addr().unwrap().port();
    let endpoint = format!("tcp/127.0.0.1:{port}");
    let mut config = zenoh::Config::default();
    for (key, value) in [
        ("mode", "\"router\"".to_owned()),
        ("listen/endpoints", format!("[{endpoint:?}]")),
        ("connect/endpoints", format!("[{upstream:?}]")),
        ("scouting/multicast/enabled", "false".to_owned()),
        ("scouting/gossip/enabled", "false".to_owned()),
    ] {
        config.insert_json5(key, &value).unwrap();
    }
    (zenoh::open(config).await.unwrap(), endpoint)
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn clients_play_through_one_router_and_through_two() {
    let (server, observer) = start_server().await;
    let (near, one_hop) = router(&server.endpoint).await;
    let (far, two_hops) = router(&one_hop).await;
    let direct = connect(&server.endpoint, "direct").await;
    for (endpoint, name) in [(&one_hop, "one hop"), (&two_hops, "two hops")] {
        let session = connect(endpoint, name).await;
        await_clients(&observer, 2).await;
        let actor = session.actor().unwrap();
        let mut first = None;
        let driven = tokio::time::timeout(SOON, async {
            loop {
                let snapshot = next_snapshot(&session).await;
                session.send(ahead()).await.unwrap();
                direct.send(Default::default()).await.unwrap();
                let Some(now) = position(&session, &snapshot, actor) else { continue };
                if ground_distance(*first.get_or_insert(now), now) > FAR {
                    break;
                }
            }
        });
        driven.await.unwrap_or_else(|_| panic!("{name}: it does not get anywhere"));
        session.say(name).await.unwrap_or_else(|error| panic!("{name}: {error}"));
        let heard = tokio::time::timeout(SOON, async {
            while let Some(event) = direct.next_event().await {
                if matches!(&event, SessionEvent::Happened(Event::Said { text, .. }) if text == name) {
                    break;
                }
            }
        });
        heard.await.unwrap_or_else(|_| panic!("{name}: nobody heard it"));
        let counts = session.leave().await;
        assert_eq!((counts.malformed, counts.events_missed), (0, 0), "{name}");
        // Its token goes with it, over all routers.
        await_clients(&observer, 1).await;
    }
    direct.leave().await;
    for router in [far, near] {
        router.close().await.unwrap();
    }
    server.stop().unwrap_or_else(|error| panic!("{error}"));
}

/// The inputs of all who are behind a router come over one connection, and within a millisecond, since all of them aim for the
/// same moment.
#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn players_behind_one_router_do_not_crowd_each_other_out() {
    let (server, _observer) = start_patient_server().await;
    let (near, one_hop) = router(&server.endpoint).await;
    let mut crowd = Vec::new();
    for i in 0..CROWD {
        crowd.push(connect(&one_hop, &format!("player {i}")).await);
    }
    let mut arrived = 0;
    for _ in 0..ROUNDS {
        let mut sent = Vec::new();
        for session in &crowd {
            sent.push(session.send(ahead()).await.unwrap());
        }
        for (session, sequence) in crowd.iter().zip(sent) {
            for _ in 0..PATIENCE {
                if next_snapshot(session).await.ack().received >= sequence {
                    arrived += 1;
                    break;
                }
            }
        }
    }
    // A router may drop one now and then, where it is kept from a core.
    assert!(arrived * 4 > 3 * CROWD * ROUNDS, "{arrived} of {} inputs arrived", CROWD * ROUNDS);
    for session in crowd {
        session.leave().await;
    }
    near.close().await.unwrap();
    server.stop().unwrap_or_else(|error| panic!("{error}"));
}
