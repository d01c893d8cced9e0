//! What no client of ours would send: the server counts it and goes on.

use pita_protocol::message::{
    Controls, InputFrame, InputPacket, JoinAccepted, JoinReply, JoinRequest, Refusal, RefusedCounts, Role,
};
use pita_protocol::seal::TAG_BYTES;
use pita_protocol::{PROTOCOL_VERSION, decode, encode};
use pita_tests::observer::Observer;

use crate::clients::{ahead, connect, next_snapshot};
use crate::{SOON, await_clients, eventually, start_patient_server};

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn joins_that_cannot_be_are_refused_in_words_and_counted() {
    let (server, observer) = start_patient_server().await;
    let request = encode(&JoinRequest {
        name: "mallory".into(),
        role: Role::Player,
        bytes_per_s: None,
        cells_along: false,
        resume: None,
    });
    let mut other_version = request.clone();
    other_version[0] += 1;
    let reply = join(&observer, other_version).await;
    let expected = Refusal::Version { server: PROTOCOL_VERSION, client: PROTOCOL_VERSION + 1 };
    assert!(matches!(&reply, JoinReply::Refused(refusal) if *refusal == expected), "{reply:?}");

    let nameless = encode(&JoinRequest {
        name: "\n".into(),
        role: Role::Player,
        bytes_per_s: None,
        cells_along: false,
        resume: None,
    });
    let malformed =
        [Vec::new(), vec![PROTOCOL_VERSION as u8, 1, 255, 255], request[..4].to_vec(), vec![1; 5000], nameless];
    let malformed_count = malformed.len() as u64;
    for bytes in malformed {
        let reply = join(&observer, bytes.clone()).await;
        assert!(matches!(reply, JoinReply::Refused(Refusal::Malformed(_))), "{bytes:?}: {reply:?}");
    }
    let expected = RefusedCounts { join_version: 1, join_malformed: malformed_count, ..Default::default() };
    await_refused(&observer, expected).await;
    assert_works(&observer, &server.endpoint).await;
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn inputs_that_cannot_be_are_dropped_and_counted() {
    let (server, observer) = start_patient_server().await;
    let mallory = Mallory::join(&observer).await;
    let good = mallory.packet(1, ahead());
    let mut expected = RefusedCounts::default();

    mallory.send(&good).await;
    mallory.send(&mallory.packet(2, ahead())).await;

    mallory.send(&good).await;
    expected.input_stale = 1;
    await_refused(&observer, expected).await;

    mallory.send(&[good.clone(), vec![0; 700]].concat()).await;
    expected.input_too_long = 1;
    await_refused(&observer, expected).await;

    let unfit = [f32::NAN, f32::INFINITY, f32::NEG_INFINITY, -0.5, 1.5];
    for (sent, throttle) in (1..).zip(unfit) {
        mallory.send(&mallory.packet(2 + sent, Controls { throttle, ..Controls::default() })).await;
        expected.input_content = u64::from(sent);
        await_refused(&observer, expected).await;
    }

    let mut forged = mallory.packet(20, ahead());
    *forged.last_mut().unwrap() ^= 1;
    mallory.send(&forged).await;
    mallory.send_as(mallory.joined.slot + 1, &good).await;
    mallory.send_as(mallory.joined.slot + 2, &good).await;
    // Of slots that there are not nobody hears.
    mallory.send_as(9999, &good).await;
    (expected.input_forged, expected.input_no_session) = (1, 2);
    await_refused(&observer, expected).await;

    let other_epoch = InputPacket { epoch: mallory.joined.epoch + 1, ..mallory.unsealed(21, ahead()) };
    mallory.send(&mallory.sealed(&encode(&other_epoch))).await;
    expected.input_no_session = 3;
    await_refused(&observer, expected).await;

    let mut other_version = encode(&mallory.unsealed(22, ahead()));
    other_version[0] += 1;
    mallory.send(&mallory.sealed(&other_version)).await;
    expected.input_version = 1;
    await_refused(&observer, expected).await;

    let truncated = encode(&mallory.unsealed(23, ahead()));
    mallory.send(&mallory.sealed(&truncated[..truncated.len() - 2])).await;
    mallory.send(b"short").await;
    expected.input_malformed = 2;
    await_refused(&observer, expected).await;

    assert_works(&observer, &server.endpoint).await;
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn queries_that_cannot_be_read_are_counted() {
    let (server, observer) = start_patient_server().await;
    let query = observer.session().get(observer.keys().ticks()).payload(vec![255; 20]).timeout(SOON);
    let replies = query.await.unwrap();
    assert!(replies.recv_async().await.map_or(true, |reply| reply.result().is_err()), "an answer to nonsense");
    await_refused(&observer, RefusedCounts { query_malformed: 1, ..Default::default() }).await;
    assert_works(&observer, &server.endpoint).await;
}

/// Someone with a session who sends what the library would not.
struct Mallory<'a> {
    observer: &'a Observer,
    joined: JoinAccepted,
}

impl<'a> Mallory<'a> {
    async fn join(observer: &'a Observer) -> Self {
        let request = encode(&JoinRequest {
            name: "mallory".into(),
            role: Role::Player,
            bytes_per_s: None,
            cells_along: false,
            resume: None,
        });
        match join(observer, request).await {
            JoinReply::Accepted(joined) => Self { observer, joined: *joined },
            JoinReply::Refused(refusal) => panic!("{refusal}"),
        }
    }

    fn unsealed(&self, sequence: u32, controls: Controls) -> InputPacket {
        let frames = vec![InputFrame { sequence, tick: self.joined.description.tick, controls }];
        InputPacket { epoch: self.joined.epoch, snapshot_tick: 0, snapshots_before: 0, leave: false, frames }
    }

    fn packet(&self, sequence: u32, controls: Controls) -> Vec<u8> {
        self.sealed(&encode(&self.unsealed(sequence, controls)))
    }

    /// `body` with a right seal, whatever is in it: the layout that `pita_protocol::seal` documents.
    fn sealed(&self, body: &[u8]) -> Vec<u8> {
        let key_expr = self.observer.keys().input(self.joined.slot);
        let mut hasher = blake3::Hasher::new_keyed(&self.joined.session_key.0);
        hasher.update(&(key_expr.len() as u32).to_le_bytes()).update(key_expr.as_bytes()).update(body);
        [body, &hasher.finalize().as_bytes()[..TAG_BYTES]].concat()
    }

    async fn send(&self, bytes: &[u8]) {
        self.send_as(self.joined.slot, bytes).await;
    }

    async fn send_as(&self, slot: u16, bytes: &[u8]) {
        // Inputs of a slot that come faster than the server's limit are dropped before anything counts them.
        tokio::time::sleep(std::time::Duration::from_millis(5)).await;
        self.observer.session().put(self.observer.keys().input(slot), bytes).await.unwrap();
    }
}

async fn join(observer: &Observer, payload: Vec<u8>) -> JoinReply {
    let query = observer.session().get(observer.keys().join()).payload(payload).timeout(SOON);
    let reply = query.await.unwrap().recv_async().await.expect("an answer");
    let sample = reply.result().unwrap_or_else(|error| panic!("{error}"));
    decode(&sample.payload().to_bytes()).unwrap()
}

async fn await_refused(observer: &Observer, expected: RefusedCounts) {
    let mut counted = RefusedCounts::default();
    let done = tokio::time::timeout(SOON, async {
        while counted != expected {
            counted = observer.status().await.unwrap_or_else(|error| panic!("{error}")).refused;
        }
    });
    if done.await.is_err() {
        panic!("expected {expected:?}\ncounted {counted:?}");
    }
}

/// Somebody else joins and drives as if nothing had happened.
async fn assert_works(observer: &Observer, endpoint: &str) {
    let session = connect(endpoint, "honest").await;
    let sequence = session.send(ahead()).await.unwrap();
    eventually("the input's effect", async || (next_snapshot(&session).await.ack().sequence >= sequence).then_some(()))
        .await;
    let clients = observer.status().await.unwrap().clients;
    session.leave().await;
    await_clients(observer, clients - 1).await;
}
