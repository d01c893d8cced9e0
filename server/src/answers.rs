//! The answering thread: joins and every other query.
//!
//! Replies follow the asker's congestion control, so that a frozen asker may hold its reply up until Zenoh closes the
//! connection. That is why they have a thread of their own: Zenoh's callbacks only put queries into a bounded queue, and
//! neither inputs nor snapshots wait behind a reply.

use std::collections::HashMap;
use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::mpsc::{self, Receiver, Sender};
use std::time::Duration;

use pita_protocol::admin::{AdminReply, AdminRequest};
use pita_protocol::message::{
    Description, JoinAccepted, JoinReply, JoinRequest, Keyframes, KeyframesRequest, Refusal, Role, SayRefusal,
    SayReply, SayRequest, TicksRequest,
};
use pita_protocol::seal::{self, SessionKey, TAG_BYTES};
use pita_protocol::{Message, PROTOCOL_VERSION, WireError};
use tokio::sync::mpsc::Sender as OrderSender;
use zenoh::Wait;
use zenoh::query::Query;

use crate::admin::{Doorkeeper, NONCE_BYTES, Order, Verdict};
use crate::metrics;
use crate::sessions::{EndReason, JoinRefusal, Secrets, SessionId, Wish};
use crate::shared::Shared;

/// Most queries that wait; further ones are dropped, and their askers time out.
const QUERIES_MAX: usize = 256;

/// What a query asks for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Question {
    /// A session.
    Join,
    /// To say something to everybody.
    Say,
    /// The world.
    Describe,
    /// The arena's file.
    Source,
    /// How the daemon does.
    Status,
    /// What ticks cost.
    Ticks,
    /// What only those may ask who run the server.
    Admin,
    /// What leads to the present keyframe of a cell.
    Keyframes,
}

/// What the answering thread does next.
pub enum Work {
    /// Answers a query.
    Answer(Question, Query),
    /// Accepts the join of a session.
    Admitted {
        /// The session.
        id: SessionId,
        /// Its actor.
        actor: Option<u32>,
        /// The world, the actor in it.
        description: Arc<Description>,
    },
    /// The session is over, and why; if its join still waits, it is refused.
    Ended(SessionId, EndReason),
    /// Refuses what waits and ends the thread.
    Stop,
}

/// The way into the thread's queue. Never waits.
#[derive(Clone)]
pub struct Asker {
    shared: Arc<Shared>,
    work: Sender<Work>,
    queries: Arc<AtomicUsize>,
}

impl Asker {
    /// Queues `query`, unless too many wait.
    pub fn ask(&self, question: Question, query: Query) {
        if self.queries.fetch_add(1, Ordering::Relaxed) >= QUERIES_MAX {
            self.queries.fetch_sub(1, Ordering::Relaxed);
            self.shared.counters.queries_dropped.add(1);
            return;
        }
        self.tell(Work::Answer(question, query));
    }

    /// Queues `work` other than queries, of which there is little: two a session.
    pub fn tell(&self, work: Work) {
        // The thread ends last; after that nobody is left to be told anything.
        let _ = self.work.send(work);
    }
}

/// The thread's state.
pub struct Answering {
    shared: Arc<Shared>,
    work: Receiver<Work>,
    queries: Arc<AtomicUsize>,
    /// Sessions that exist, but whose player is not in the arena yet.
    pending: HashMap<SessionId, (Query, SessionKey)>,
    doorkeeper: Doorkeeper,
    /// To the daemon's own loop.
    orders: OrderSender<Order>,
}

impl Answering {
    /// The thread's state and the way into its queue; what `doorkeeper` lets pass is sent to `orders`.
    pub fn new(shared: Arc<Shared>, doorkeeper: Doorkeeper, orders: OrderSender<Order>) -> (Self, Asker) {
        let (sender, work) = mpsc::channel();
        let queries = Arc::new(AtomicUsize::new(0));
        let asker = Asker { shared: shared.clone(), work: sender, queries: queries.clone() };
        (Self { shared, work, queries, pending: HashMap::new(), doorkeeper, orders }, asker)
    }

    /// Answers until [`Work::Stop`].
    pub fn run(mut self) {
        while let Ok(work) = self.work.recv() {
            match work {
                Work::Answer(question, query) => {
                    self.queries.fetch_sub(1, Ordering::Relaxed);
                    self.answer(question, query);
                }
                Work::Admitted { id, actor, description } => self.accept(id, actor, &description),
                Work::Ended(id, reason) => self.refuse_pending(id, reason),
                Work::Stop => break,
            }
        }
        for (_, (query, _)) in self.pending.drain() {
            reply(&self.shared, &query, self.shared.keys.join(), &JoinReply::Refused(Refusal::Closing));
        }
    }

    fn answer(&mut self, question: Question, query: Query) {
        let shared = &*self.shared;
        shared.counters.received_bytes.add(query.payload().map_or(0, |payload| payload.len()) as u64);
        match question {
            Question::Join => self.join(query),
            Question::Admin => self.admin(query),
            Question::Say => self.say(&query),
            Question::Describe => reply(shared, &query, shared.keys.describe(), &*shared.description()),
            Question::Source => reply(shared, &query, shared.keys.source(), &*shared.source()),
            Question::Status => reply(shared, &query, shared.keys.status(), &metrics::status(shared)),
            Question::Keyframes => match payload(&query) {
                Ok(request) => reply(shared, &query, shared.keys.keyframes(), &keyframes(shared, &request)),
                Err(error) => {
                    shared.counters.query_malformed.add(1);
                    reply_error(shared, &query, &error.to_string());
                }
            },
            Question::Ticks => match payload::<TicksRequest>(&query) {
                Ok(request) => {
                    let records = shared.metrics().records_since(request.since);
                    reply(shared, &query, shared.keys.ticks(), &records);
                }
                Err(error) => {
                    shared.counters.query_malformed.add(1);
                    reply_error(shared, &query, &error.to_string());
                }
            },
        }
    }

    fn join(&mut self, query: Query) {
        match self.open_session(&query) {
            Ok((id, key)) => {
                self.pending.insert(id, (query, key));
                self.shared.wake_publisher();
            }
            Err(refusal) => {
                self.refuse(&query, refusal);
            }
        }
    }

    fn admin(&mut self, query: Query) {
        let key_expr = self.shared.keys.admin();
        let fits = query.payload().filter(|payload| payload.len() <= AdminRequest::MAX_BYTES + TAG_BYTES);
        let sealed = fits.map(|payload| payload.to_bytes()).unwrap_or_default();
        let verdict = match nonce() {
            Ok(nonce) => {
                self.doorkeeper.judge(&sealed, &key_expr, Duration::from_millis(self.shared.clock.ms()), nonce)
            }
            Err(_) => Verdict::Answer(AdminReply::Refused),
        };
        match verdict {
            Verdict::Answer(answer) => {
                let refused = u64::from(answer == AdminReply::Refused);
                self.shared.counters.query_malformed.add(refused);
                reply(&self.shared, &query, key_expr, &answer);
            }
            Verdict::Do(action) => {
                if let Err(full) = self.orders.try_send(Order { action, query }) {
                    let busy = AdminReply::answered(false, ["the server is busy with others: ask again".to_owned()]);
                    reply(&self.shared, &full.into_inner().query, key_expr, &busy);
                }
            }
        }
    }

    fn say(&self, query: &Query) {
        let answer = match self.hear(query) {
            Ok(()) => SayReply::Said,
            Err(refusal) => {
                self.shared.counters.say_refused.add(1);
                SayReply::Refused(refusal)
            }
        };
        self.shared.wake_publisher();
        reply(&self.shared, query, query.key_expr().to_string(), &answer);
    }

    fn hear(&self, query: &Query) -> Result<(), SayRefusal> {
        let key_expr = query.key_expr().as_str();
        let slot = self.shared.keys.slot_of_say(key_expr).ok_or(SayRefusal::NotYours)?;
        let payload = query.payload().filter(|payload| payload.len() <= SayRequest::MAX_BYTES + TAG_BYTES);
        let sealed = payload.ok_or(SayRefusal::NotYours)?.to_bytes();
        let mut sessions = self.shared.sessions();
        let key = sessions.key(slot).ok_or(SayRefusal::NotYours)?;
        let request: SayRequest = seal::open(&sealed, key, key_expr).map_err(|_| SayRefusal::NotYours)?;
        sessions.say(slot, &request, self.shared.clock.ms())
    }

    /// Says why there is no session, and counts it.
    fn refuse(&self, query: &Query, refusal: Refusal) {
        let counters = &self.shared.counters;
        match &refusal {
            Refusal::Version { .. } => counters.join_version.add(1),
            Refusal::Malformed(_) => counters.join_malformed.add(1),
            Refusal::Full { .. } => counters.join_full.add(1),
            Refusal::Ended { .. } => counters.join_ended.add(1),
            Refusal::NameTaken { .. } | Refusal::Banned { .. } => counters.join_name.add(1),
            Refusal::Over => counters.join_over.add(1),
            Refusal::Closing => {}
        }
        reply(&self.shared, query, self.shared.keys.join(), &JoinReply::Refused(refusal));
    }

    /// Begins the session that `query` asks for.
    fn open_session(&self, query: &Query) -> Result<(SessionId, SessionKey), Refusal> {
        let request: JoinRequest = payload(query).map_err(|error| match error {
            WireError::Version { theirs } => Refusal::Version { server: PROTOCOL_VERSION, client: theirs },
            other => Refusal::Malformed(other.to_string()),
        })?;
        let secrets = new_secrets().map_err(|error| {
            tracing::error!("no randomness from the operating system: {error}");
            Refusal::Closing
        })?;
        let mut sessions = self.shared.sessions();
        let key = secrets.key.clone();
        let now_ms = self.shared.clock.ms();
        let JoinRequest { ref name, role, bytes_per_s, cells_along, ref resume } = request;
        let wish = Wish { name, role, bytes_per_s, cells_along };
        let joined = match resume {
            Some(proof) => sessions.resume(proof, wish, secrets, now_ms),
            None => sessions.join(wish, secrets, now_ms),
        };
        let id = joined.map_err(|refusal| match refusal {
            JoinRefusal::Full => Refusal::Full { slots: sessions.slots_of(request.role) },
            JoinRefusal::NameTaken => Refusal::NameTaken { name: request.name.clone() },
            JoinRefusal::Banned => Refusal::Banned { name: request.name.clone() },
            JoinRefusal::Over => Refusal::Over,
            JoinRefusal::Closing => Refusal::Closing,
        })?;
        Ok((id, key))
    }

    fn accept(&mut self, id: SessionId, actor: Option<u32>, description: &Description) {
        let Some((query, session_key)) = self.pending.remove(&id) else { return };
        let accepted = JoinAccepted {
            slot: id.slot,
            epoch: id.epoch,
            session_key,
            tick_hz: self.shared.tick_hz,
            input_timeout_ms: self.shared.input_timeout_ms,
            actor,
            description: description.clone(),
        };
        let answer = JoinReply::Accepted(Box::new(accepted));
        let (bytes, most) = (pita_protocol::encode(&answer).len(), JoinReply::MAX_BYTES);
        if bytes > most {
            // The session ends by its silence.
            let reason = format!("the arena has grown to {bytes} bytes of description, at most {most} are allowed");
            tracing::error!("slot {}: {reason}; remove actors", id.slot);
            return self.refuse(&query, Refusal::Ended { reason });
        }
        reply(&self.shared, &query, self.shared.keys.join(), &answer);
    }

    fn refuse_pending(&mut self, id: SessionId, reason: EndReason) {
        let Some((query, _)) = self.pending.remove(&id) else { return };
        let refusal = match reason {
            // Only players need a place in the arena.
            EndReason::NoPlace => Refusal::Full { slots: self.shared.sessions().slots_of(Role::Player) },
            EndReason::Left | EndReason::ConnectionLost | EndReason::Resumed | EndReason::Silent { .. } => {
                Refusal::Ended { reason: reason.to_string() }
            }
        };
        self.refuse(&query, refusal);
    }
}

/// The random part of a challenge, from the operating system.
fn nonce() -> Result<[u8; NONCE_BYTES], rand::rngs::SysError> {
    use rand::TryRng;
    let mut nonce = [0; NONCE_BYTES];
    rand::rngs::SysRng.try_fill_bytes(&mut nonce)?;
    Ok(nonce)
}

/// Secrets from the operating system.
fn new_secrets() -> Result<Secrets, rand::rngs::SysError> {
    use rand::TryRng;
    let mut key = [0; 32];
    rand::rngs::SysRng.try_fill_bytes(&mut key)?;
    Ok(Secrets { epoch: rand::rngs::SysRng.try_next_u32()?, key: SessionKey(key) })
}

/// What leads from the keyframes that the asker has to the present ones.
fn keyframes(shared: &Shared, request: &KeyframesRequest) -> Keyframes {
    let mut answer = Keyframes::default();
    for &wanted in &request.cells {
        answer.push(wanted, shared.keyframes(wanted.cell).as_deref().unwrap_or_default());
    }
    answer
}

/// Decodes what `query` carries; nothing at all is malformed.
fn payload<M: Message>(query: &Query) -> Result<M, WireError> {
    let payload = query.payload().ok_or(WireError::Malformed)?;
    // Its length comes first: putting fragments together allocates.
    if payload.len() > M::MAX_BYTES {
        return Err(WireError::TooLong { bytes: payload.len(), max: M::MAX_BYTES });
    }
    pita_protocol::decode(&payload.to_bytes())
}

fn reply<M: Message>(shared: &Shared, query: &Query, key: String, message: &M) {
    let bytes = pita_protocol::encode(message);
    shared.counters.sent_bytes.add(bytes.len() as u64);
    if let Err(reason) = query.reply(key, bytes).wait() {
        tracing::debug!("reply to {}: {reason}", query.key_expr());
    }
}

fn reply_error(shared: &Shared, query: &Query, text: &str) {
    shared.counters.sent_bytes.add(text.len() as u64);
    if let Err(reason) = query.reply_err(text).wait() {
        tracing::debug!("reply to {}: {reason}", query.key_expr());
    }
}
