//! The publishing thread: everything that leaves for clients without being asked for.
//!
//! Owns the declared publishers, one for each session, one for each layer of a [cell](crate::cells) and one for events, the
//! numbering of events and the description that they add up to. It wakes for every frame, quantises the state once, codes
//! and puts each cell once for everybody, and then for each session its own snapshot. Nothing here waits for a client:
//! cells, snapshots and events are dropped where a connection takes no more.

mod cell_outlets;
mod outlet;

use std::collections::{BTreeMap, VecDeque};
use std::sync::Arc;
use std::time::Duration;

use pita_game::ArenaEvent;
use pita_protocol::dof::State;
use pita_protocol::message::{Description, Event, EventMessage, Role};

use crate::answers::{Asker, Work};
use crate::boarding::{Boarding, Ledger, Out};
use crate::cells::{self, Cells, Head, OwnStream};
use crate::crowd::Crowd;
use crate::description;
use crate::frame::Frame;
use crate::metrics::Traffic;
use crate::sessions::{Change, EndReason, SessionId};
use crate::shared::{Phase, Shared};
use cell_outlets::CellOutlets;
use outlet::Outlet;

/// How long the thread sleeps where nothing wakes it; sessions time out meanwhile.
const IDLE: Duration = Duration::from_millis(100);

/// One session's snapshots.
struct Feed {
    id: SessionId,
    outlet: Outlet,
    /// For cells, where they come along.
    along: Option<Outlet>,
    own: OwnStream,
}

/// The thread's state.
pub struct Publishing {
    shared: Arc<Shared>,
    session: zenoh::Session,
    asker: Asker,
    events: Outlet,
    feeds: BTreeMap<u16, Feed>,
    ledger: Ledger,
    /// Waits for room on the way to the tick thread.
    boarding: VecDeque<Boarding>,
    changes: Vec<Change>,
    /// Events that are in the description and not out yet, encoded.
    coming: Vec<Vec<u8>>,
    description: Arc<Description>,
    tick: u64,
    cells: Cells,
    cell_outlets: CellOutlets,
    /// The newest frame in steps.
    state: State,
    /// And who that is.
    crowd: Crowd,
    has_said_closing: bool,
}

impl Publishing {
    /// Declares the event publisher; the world is divided as `cells` says.
    ///
    /// # Errors
    /// What Zenoh says.
    pub fn new(
        shared: Arc<Shared>,
        session: zenoh::Session,
        asker: Asker,
        cells: cells::Settings,
    ) -> zenoh::Result<Self> {
        let slots = shared.sessions().slots();
        Ok(Self {
            events: Outlet::for_events(&session, shared.keys.event())?,
            ledger: Ledger::new(slots),
            description: shared.description(),
            state: State::new(shared.description().precision)?,
            cells: Cells::new(cells),
            cell_outlets: CellOutlets::new(shared.clone(), session.clone()),
            shared,
            session,
            asker,
            feeds: BTreeMap::new(),
            crowd: Crowd::default(),
            boarding: VecDeque::new(),
            changes: Vec::new(),
            coming: Vec::new(),
            tick: 0,
            has_said_closing: false,
        })
    }

    /// Publishes until the daemon has [ended](Phase::Ended).
    pub fn run(mut self) {
        self.shared.this_thread_publishes();
        while self.shared.phase() != Phase::Ended {
            self.shared.sessions().expire(self.shared.clock.ms());
            self.follow_sessions();
            self.take_frames();
            if self.shared.phase() == Phase::Closing && !self.has_said_closing {
                self.has_said_closing = true;
                self.add_event(Event::Closing { reason: "the server ends".to_owned() });
                self.publish_events();
            }
            if self.shared.frames.is_drained() {
                std::thread::park_timeout(IDLE);
            }
        }
    }

    // --- sessions --------------------------------------------------------------------------------------------------

    /// Acts on sessions that began or ended, unless the tick thread has not taken the last ones yet.
    fn follow_sessions(&mut self) {
        if self.boarding.is_empty() {
            let mut changes = std::mem::take(&mut self.changes);
            self.shared.sessions().take_changes(&mut changes);
            for change in changes.drain(..) {
                match change {
                    Change::Began { id, role, name, bytes_per_s, cells_along } => {
                        self.begin_feed(id, bytes_per_s, cells_along);
                        self.begin_session(id, role, name);
                    }
                    Change::Resumed { from, to, bytes_per_s, cells_along } => {
                        self.resume_session(from, to, bytes_per_s, cells_along);
                    }
                    Change::Said { slot, text } => self.add_event(Event::Said { slot, text }),
                    Change::Ended { id, role, reason } => self.end_session(id, role, reason),
                }
            }
            self.changes = changes;
            self.publish_events();
        }
        while let Some(boarding) = self.boarding.pop_front() {
            if let Err(full) = self.shared.boarding.push(boarding) {
                self.boarding.push_front(full);
                break;
            }
        }
    }

    fn begin_feed(&mut self, id: SessionId, bytes_per_s: u32, cells_along: bool) {
        let outlets = Outlet::for_snapshots(&self.session, self.shared.keys.snapshot(id.slot))
            .and_then(|outlet| Ok((outlet, self.along(id.slot, cells_along)?)));
        match outlets {
            Ok((outlet, along)) => {
                let precision = *self.state.precision();
                let own = OwnStream::new(precision, bytes_per_s, self.shared.tick_hz);
                self.feeds.insert(id.slot, Feed { id, outlet, along, own });
            }
            Err(reason) => tracing::error!("no publisher for slot {}: {reason}", id.slot),
        }
    }

    /// What puts cells on the key of the snapshots of `slot`, where they are `wanted` there.
    fn along(&self, slot: u16, wanted: bool) -> zenoh::Result<Option<Outlet>> {
        wanted.then(|| Outlet::for_cells(&self.session, self.shared.keys.snapshot(slot))).transpose()
    }

    fn begin_session(&mut self, id: SessionId, role: Role, name: String) {
        tracing::info!("slot {}: {name:?} joins as {role:?}", id.slot);
        match role {
            Role::Player => self.board(Boarding::Enter { id, name }),
            Role::Spectator => {
                self.add_event(Event::Joined { slot: id.slot, name });
                self.admit(id);
            }
        }
    }

    /// The arena notices nothing: the car is there, or on its way. The client knows nothing any more, so that what it is sent
    /// begins anew, and so does what it pays for.
    fn resume_session(&mut self, from: SessionId, to: SessionId, bytes_per_s: u32, cells_along: bool) {
        let along = self.along(to.slot, cells_along).unwrap_or_else(|reason| {
            tracing::error!("no publisher of cells for slot {}: {reason}", to.slot);
            None
        });
        if let Some(feed) = self.feeds.get_mut(&to.slot) {
            let own = OwnStream::new(*self.state.precision(), bytes_per_s, self.shared.tick_hz);
            (feed.id, feed.along, feed.own) = (to, along, own);
        }
        // Whoever still waits for the earlier join waits for nothing.
        self.asker.tell(Work::Ended(from, EndReason::Resumed));
        tracing::info!("slot {}: resumed", to.slot);
        let is_in = !self.ledger.resumed(from, to);
        self.boarding.push_back(Boarding::Resume { from, to });
        if is_in {
            self.admit(to);
        }
    }

    fn end_session(&mut self, id: SessionId, role: Role, reason: EndReason) {
        self.feeds.remove(&id.slot);
        self.asker.tell(Work::Ended(id, reason));
        tracing::info!("slot {}: ended, {reason}", id.slot);
        let (slot, text) = (id.slot, reason.to_string());
        match (role, reason) {
            // The arena never had it.
            (Role::Player, EndReason::NoPlace) => {}
            (Role::Player, _) => self.board(Boarding::Leave { slot, reason: text }),
            (Role::Spectator, _) => self.add_event(Event::Left { slot, reason: text }),
        }
    }

    fn board(&mut self, boarding: Boarding) {
        self.ledger.sent(&boarding);
        self.boarding.push_back(boarding);
    }

    /// Answers the join of `id`: from now on it is in.
    fn admit(&mut self, id: SessionId) {
        Arc::make_mut(&mut self.description).tick = self.tick;
        let actor = description::actor_of(&self.description, id.slot);
        self.asker.tell(Work::Admitted { id, actor, description: self.description.clone() });
    }

    // --- frames ----------------------------------------------------------------------------------------------------

    /// Publishes the events of all waiting frames and the state of the newest.
    fn take_frames(&mut self) {
        while let Some(mut frame) = self.shared.frames.take_filled() {
            self.tick = frame.tick;
            for event in frame.events.drain(..) {
                self.take_arena_event(event);
            }
            self.publish_events();
            if self.shared.frames.is_drained() {
                self.publish_snapshots(&mut frame);
            } else {
                self.shared.counters.frames_superseded.add(1);
            }
            self.measure(&frame);
            self.shared.frames.put_free(frame);
        }
    }

    fn take_arena_event(&mut self, event: ArenaEvent) {
        match event {
            ArenaEvent::ActorAdded(actor) => self.add_event(Event::ActorAdded(description::bounded_actor(&actor))),
            ArenaEvent::ActorRemoved(id) => self.add_event(Event::ActorRemoved { id }),
            ArenaEvent::Effect(effect) => self.add_event(Event::Effect(description::effect(&effect))),
            ArenaEvent::KnockedOut { actor, by } => self.add_event(Event::KnockedOut { actor, by }),
            ArenaEvent::Scored { actor, points } => self.add_event(Event::Scored { actor, points }),
            ArenaEvent::RoundEnded { number, winner } => self.add_event(Event::RoundEnded { number, winner }),
            ArenaEvent::RoundBegan { number } => self.add_event(Event::RoundBegan { number }),
            ArenaEvent::Entered { slot, name } => {
                self.add_event(Event::Joined { slot, name });
                if let Some(id) = self.ledger.entered(slot) {
                    self.admit(id);
                }
            }
            ArenaEvent::Left { slot, reason } => match self.ledger.out(slot) {
                Out::Left => self.add_event(Event::Left { slot, reason }),
                Out::Refused(id) => {
                    tracing::warn!("slot {slot}: the arena refused the player: {reason}");
                    self.shared.sessions().refused_by_arena(id);
                }
            },
        }
    }

    /// Makes the description contain `event`, which is [published](Self::publish_events) with others: as long as nobody else
    /// has the description it is not copied.
    fn add_event(&mut self, event: Event) {
        let sequence = self.description.event_sequence.wrapping_add(1);
        description::apply(Arc::make_mut(&mut self.description), &event, sequence, self.tick);
        self.coming.push(pita_protocol::encode(&EventMessage { sequence, tick: self.tick, event }));
    }

    /// Publishes what was added. The description comes first: who asks for it after an event finds the event in it.
    fn publish_events(&mut self) {
        if self.coming.is_empty() {
            return;
        }
        self.shared.set_description(self.description.clone());
        for bytes in self.coming.drain(..) {
            self.shared.counters.sent_bytes.add((bytes.len() * self.feeds.len()) as u64);
            self.events.put(bytes);
        }
    }

    /// The cells once for everybody, and for every session its own actor, coded against what it acknowledged.
    fn publish_snapshots(&mut self, frame: &mut Frame) {
        if self.feeds.is_empty() {
            self.cells.clear();
            return self.cell_outlets.publish(&self.cells);
        }
        frame.quantise(&mut self.state, &mut self.crowd);
        self.cells.tick(frame.tick, &self.state, &self.crowd);
        self.cell_outlets.publish(&self.cells);
        self.find_own();
        for feed in self.feeds.values_mut() {
            // Acknowledgements are in order of slot.
            let found =
                frame.acks.binary_search_by_key(&feed.id.slot, |(acked, _)| acked.slot).map(|at| frame.acks[at]);
            let ack = found.ok().filter(|(acked, _)| *acked == feed.id).map(|(_, ack)| ack).unwrap_or_default();
            let head = Head {
                epoch: feed.id.epoch,
                tick: frame.tick,
                ack,
                event_sequence: self.description.event_sequence,
                acknowledged: self.shared.sessions().acknowledged(feed.id),
            };
            if let Some(along) = &feed.along {
                feed.own.granted(&self.cells).for_each(|published| along.put(published.bytes.clone()));
            }
            let (bytes, of_cells) = feed.own.snapshot(&head, &self.cells);
            self.shared.counters.sent_bytes.add((bytes.len() + of_cells) as u64);
            feed.outlet.put(bytes);
        }
    }

    /// Hands every session the bodies that it drives.
    fn find_own(&mut self) {
        self.feeds.values_mut().for_each(|feed| feed.own.clear());
        for (body, &family) in self.state.bodies().iter().zip(self.crowd.of_bodies()) {
            let family = &self.crowd.families()[family as usize];
            if let Some(feed) = family.slot.and_then(|slot| self.feeds.get_mut(&slot)) {
                feed.own.add(&self.state, body, family);
            }
        }
    }

    fn measure(&mut self, frame: &Frame) {
        let counters = &self.shared.counters;
        let (sent, received) = (counters.sent_bytes.get(), counters.received_bytes.get());
        let mut metrics = self.shared.metrics();
        // There are no more outlets than slots.
        metrics.add_frame(frame, self.feeds.len() as u16);
        metrics.add_traffic(Traffic { at_ms: self.shared.clock.ms(), sent, received });
    }
}
