//! Three clients drive and see each other do so.

use std::collections::{HashMap, HashSet};

use pita_client::Session;
use pita_protocol::message::RefusedCounts;

use crate::clients::{ahead, connect_three, ground_distance, next_snapshot, position};
use crate::{SOON, await_clients, start_server};

/// How far every car has to get in every client's eyes, m.
const FAR: f32 = 5.0;

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn three_clients_see_each_other_drive() {
    let (server, observer) = start_server().await;
    let sessions = connect_three(&server.endpoint).await;
    await_clients(&observer, 3).await;
    let actors = sessions.each_ref().map(|session| session.actor().expect("a player has a car"));
    let slots = sessions.each_ref().map(Session::slot);
    assert_eq!(HashSet::from(actors).len(), 3, "{actors:?}");
    assert_eq!(HashSet::from(slots).len(), 3, "{slots:?}");

    let [ann, bob, cid] = sessions.each_ref().map(|session| drive_and_watch(session, &actors));
    let watched: [_; 3] = tokio::join!(ann, bob, cid).into();
    for (session, far) in sessions.iter().zip(watched) {
        assert_eq!(far.len(), 3, "slot {} saw the actors {actors:?} get so far: {far:?}", session.slot());
    }
    for session in &sessions {
        let named: Vec<_> = session.roster().actors().filter(|a| a.slot.is_some()).map(|a| a.name.clone()).collect();
        assert!(["ann", "bob", "cid"].iter().all(|name| named.contains(&name.to_string())), "{named:?}");
    }
    for session in sessions {
        let statistics = session.leave().await;
        assert_eq!(statistics.malformed, 0);
        assert!(statistics.inputs_sent > 0 && statistics.snapshots_received > 0, "{statistics:?}");
    }
    await_clients(&observer, 0).await;
    let status = observer.status().await.unwrap();
    // A good-bye that is repeated may come after the session's end.
    let refused = RefusedCounts { input_no_session: 0, ..status.refused };
    assert_eq!((refused, status.quarantined), (RefusedCounts::default(), 0), "{status:?}");
    server.stop().unwrap_or_else(|error| panic!("{error}"));
}

/// Drives ahead until every one of `actors` was seen [`FAR`] from where it first was; answers how far each got.
async fn drive_and_watch(session: &Session, actors: &[u32]) -> HashMap<u32, f32> {
    let mut first = HashMap::new();
    let mut far = HashMap::new();
    let watched = tokio::time::timeout(SOON, async {
        while far.len() < actors.len() {
            let snapshot = next_snapshot(session).await;
            session.send(ahead()).await.unwrap_or_else(|error| panic!("{error}"));
            for &actor in actors {
                let Some(now) = position(session, &snapshot, actor) else { continue };
                let distance = ground_distance(*first.entry(actor).or_insert(now), now);
                if distance > FAR {
                    far.insert(actor, distance);
                }
            }
        }
    });
    let _ = watched.await;
    far
}
