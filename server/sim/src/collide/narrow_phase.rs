//! Pairs that may touch: what is kept of each from tick to tick, and the fine phase of all of them, on all threads.

use std::collections::BTreeMap;

use glam::DVec3;

use super::collision::{Closest, Phase, Touch};
use super::fine_phase::FinePhase;
use super::manifold::POINTS_MAX;
use super::still::Still;
use super::{ContactPoint, Partner, StaticId, Surface};
use crate::dof::BodyId;
use crate::settings::Settings;
use crate::threads::{Threads, Workspaces};

/// Fewer pairs than this are looked at by the calling thread: waking another one costs more.
const PARALLEL_PAIRS_MIN: usize = 64;

/// What is kept of a pair from tick to tick.
#[derive(Default)]
pub(super) struct Pair {
    pub points: Vec<ContactPoint>,
    /// Last normal in the axes of the first shape's core.
    pub normal: Option<DVec3>,
    /// What was found of it when it was last looked at.
    pub still: Option<Still>,
    /// Ticks that it has been known for.
    age: u32,
    /// That it sees only: its points are no contacts.
    pub is_sensor: bool,
    /// Where it touches in this tick, and where it did in the last.
    pub touch: Option<Closest>,
    pub last_touch: Option<Closest>,
    /// Of the last tick, N s.
    impulse: f64,
}

impl Pair {
    /// With room for all points that most pairs ever have.
    fn roomy() -> Self {
        Self { points: Vec::with_capacity(POINTS_MAX), ..Self::default() }
    }

    /// Nothing is known of it; what it has of memory it keeps.
    fn forget(&mut self) {
        let mut points = std::mem::take(&mut self.points);
        points.clear();
        *self = Self { points, ..Self::default() };
    }

    /// Starts a tick.
    fn begin(&mut self, settings: &Settings) {
        self.age = self.age.saturating_add(1);
        self.last_touch = self.touch.take();
        self.impulse = settings.dt * self.points.iter().map(|point| point.normal_force).sum::<f64>();
    }

    /// Whether another look, after [`Pair::begin`], would find of two colliders that keep still what the last one found,
    /// with the memory that it has; then it stays as it is.
    pub fn stays(&mut self, surface: Surface) -> bool {
        let is_same = |point: &ContactPoint| point.is_settled && point.surface == surface;
        let stays = self.age > 1 && !self.is_sensor && self.points.iter().all(is_same);
        if stays {
            self.touch = self.last_touch;
        }
        stays
    }

    /// What there is to tell of it, after [`Pair::begin`].
    fn tell(&self, key: Key) -> Option<Touch> {
        let (phase, closest) = match (self.last_touch, self.touch) {
            (None, None) => return None,
            (None, Some(now)) => (Phase::Begin, now),
            (Some(_), Some(now)) => (Phase::Stay, now),
            (Some(last), None) => (Phase::End, last),
        };
        Some(Touch { key, phase, closest, impulse: self.impulse, is_cancelled: false })
    }
}

/// Serial of the first body, and its partner.
pub(crate) type Key = (u32, Partner);

/// The second half of a pair, as the trees know it.
#[derive(Clone, Copy, Debug)]
pub(super) enum Other {
    /// A hull, and its body where that sleeps.
    Hull(u32, Option<BodyId>),
    Piece(StaticId),
}

/// A pair that the fine phase is to look at.
pub(super) struct Question {
    pub key: Key,
    /// Hull of the first body.
    pub hull: u32,
    pub other: Other,
    /// What is known of it.
    pub pair: Box<Pair>,
    /// Whether it touches a sleeper.
    pub wakes: bool,
}

/// A pair that is known, until it is asked about.
struct Known {
    key: Key,
    pair: Option<Box<Pair>>,
}

/// All pairs and their memory.
#[derive(Default)]
pub(super) struct NarrowPhase {
    /// Pairs of the last tick, sorted by key; empty where this tick has taken it over.
    last: Vec<Known>,
    /// Pairs of this tick, in the order in which they were asked for; sorted by key at its end.
    pairs: Vec<Question>,
    /// How many of them have been looked at.
    answered: usize,
    /// Pairs that sleep.
    asleep: BTreeMap<Key, Box<Pair>>,
    /// Pairs that ended, to be used again.
    #[expect(clippy::vec_box, reason = "the boxes are what is used again")]
    spare: Vec<Box<Pair>>,
    workspaces: Workspaces<FinePhase>,
}

impl NarrowPhase {
    /// Starts a tick.
    pub fn begin(&mut self) {
        let Self { last, pairs, answered, .. } = self;
        // Beside what woke since.
        last.extend(pairs.drain(..).map(|Question { key, pair, .. }| Known { key, pair: Some(pair) }));
        last.sort_unstable_by_key(|known| known.key);
        *answered = 0;
    }

    /// Pairs of the tick.
    pub fn len(&self) -> usize {
        self.pairs.len()
    }

    /// Takes a pair up, with what the last tick left of it where it has been one.
    pub fn ask(&mut self, key: Key, (hull, other): (u32, Other), is_sensor: bool, settings: &Settings) {
        let known = self.last.binary_search_by_key(&key, |known| known.key).ok();
        let mut pair = known.and_then(|i| self.last[i].pair.take()).unwrap_or_else(|| self.blank());
        pair.begin(settings);
        pair.is_sensor = is_sensor;
        self.pairs.push(Question { key, hull, other, pair, wakes: false });
    }

    /// Has the fine phase look at all pairs that were taken up since the last time. Answers the sleepers that are touched.
    pub fn answer(
        &mut self,
        threads: &Threads,
        look: impl Fn(&mut Question, &mut FinePhase) + Sync,
    ) -> impl Iterator<Item = BodyId> {
        let Self { pairs, answered, workspaces, .. } = self;
        let questions = &mut pairs[*answered..];
        *answered += questions.len();
        let is_worth_it = questions.len() >= PARALLEL_PAIRS_MIN;
        threads.each(questions, workspaces, is_worth_it, |_, question, fine_phase| look(question, fine_phase));
        questions.iter().filter(|question| question.wakes).filter_map(|question| match question.other {
            Other::Hull(_, sleeper) => sleeper,
            Other::Piece(_) => None,
        })
    }

    /// Room for looks at pairs of which nothing is remembered.
    pub fn workspaces(&mut self) -> &mut Workspaces<FinePhase> {
        &mut self.workspaces
    }

    /// Sets aside what is known of pairs between colliders of which `sleeps` says so, and between them and static
    /// geometry.
    pub fn sleep(&mut self, sleeps: impl Fn(u32) -> bool) {
        let Self { pairs, asleep, .. } = self;
        let both = |question: &mut Question| {
            let partner_sleeps = match question.key.1 {
                Partner::Body(b) => sleeps(b),
                Partner::Static(_) => true,
            };
            partner_sleeps && sleeps(question.key.0)
        };
        asleep.extend(pairs.extract_if(.., both).map(|Question { key, pair, .. }| (key, pair)));
    }

    /// Colliders wake: the next pairs of theirs are found again.
    pub fn wake(&mut self, serials: impl Iterator<Item = u32>) {
        let Self { asleep, last, .. } = self;
        for serial in serials {
            let of_it = (serial, Partner::Body(0))..=(serial, Partner::Static(u32::MAX));
            while let Some((&key, _)) = asleep.range(of_it.clone()).next() {
                last.push(Known { key, pair: asleep.remove(&key) });
            }
        }
        last.sort_unstable_by_key(|known| known.key);
    }

    /// Ends a tick: writes the points of all pairs that push, and what there is to tell of pairs, sorted by pair.
    pub fn finish(&mut self, contacts: &mut Vec<ContactPoint>, touches: &mut Vec<Touch>, settings: &Settings) {
        let Self { last, pairs, spare, .. } = self;
        for Known { key, pair } in last.drain(..) {
            let Some(mut pair) = pair else { continue };
            pair.begin(settings);
            touches.extend(pair.tell(key));
            spare.push(pair);
        }
        pairs.sort_unstable_by_key(|question| question.key);
        for Question { key, pair, .. } in pairs.iter() {
            touches.extend(pair.tell(*key));
            if !pair.is_sensor {
                contacts.extend_from_slice(&pair.points);
            }
        }
        touches.sort_unstable_by_key(|touch| touch.key);
    }

    /// Takes over what the solver did to the points that [`NarrowPhase::finish`] wrote, in the same order.
    pub fn remember(&mut self, contacts: &[ContactPoint]) {
        let mut contacts = contacts.iter();
        for pair in self.pairs.iter_mut().map(|question| &mut question.pair).filter(|pair| !pair.is_sensor) {
            let of_pair = pair.points.iter_mut().zip(&mut contacts);
            let changed = of_pair.filter(|(mine, theirs)| !(mine.is_settled && theirs.is_settled));
            changed.for_each(|(mine, theirs)| *mine = *theirs);
        }
    }

    /// Drops every pair of which `is_gone` says so.
    pub fn forget(&mut self, is_gone: impl Fn(Key) -> bool) {
        let Self { pairs, last, spare, .. } = self;
        let gone = pairs.extract_if(.., |question| is_gone(question.key)).map(|question| question.pair);
        spare.extend(gone);
        spare.extend(last.extract_if(.., |known| is_gone(known.key)).filter_map(|known| known.pair));
    }

    /// A pair of which nothing is known. Where there is none to spare as many are made as there are, as vectors do it.
    fn blank(&mut self) -> Box<Pair> {
        let mut pair = self.spare.pop().unwrap_or_else(|| {
            self.spare.extend((0..self.pairs.len()).map(|_| Box::new(Pair::roomy())));
            Box::new(Pair::roomy())
        });
        pair.forget();
        pair
    }
}
