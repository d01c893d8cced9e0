//! What a frame says about a body, as numbers: where users of the stream leave the integers.

use super::frame::{Body, Frame};
use super::quantise::{Group, absolute, rotate};

/// Q and Q' of one body, single precision.
#[derive(Clone, Debug, PartialEq)]
pub struct Slice {
    /// Identifies the body for as long as it lives; never used twice in a run.
    pub id: u32,
    /// What the numbers mean, one of [`kind`](super::kind).
    pub kind: u8,
    /// Tick of these numbers: an earlier one than the snapshot's where the snapshot did not carry the body.
    pub tick: u64,
    /// What the numbers of Q are, in order; rates are not among them, and a hinge is a rotation.
    pub groups: Vec<Group>,
    /// Generalised positions: m, unit quaternions x y z w, rad; in the world.
    pub q: Vec<f32>,
    /// Their rates, per second; an angular velocity in world axes for each quaternion.
    pub v: Vec<f32>,
}

/// Position and quaternion, velocity and angular velocity.
type Motion = ([f64; 7], [f64; 6]);

/// Attached bodies may be attached to attached ones; malicious chains end here.
const CHAIN_MAX: usize = 8;
/// Groups of what others are attached to, a rigid body with its rates: it is looked at for each of them.
pub(super) const CARRIER_GROUPS_MAX: usize = 4;

impl Frame {
    /// All bodies whose place is known, in order of id, for a stream of `tick_hz` ticks a second.
    pub fn slices(&self, tick_hz: f64) -> Vec<Slice> {
        self.bodies.iter().filter_map(|body| self.slice_of(body, tick_hz)).collect()
    }

    /// One body; `None` where it, or what it is attached to, is not there.
    pub fn slice(&self, id: u32, tick_hz: f64) -> Option<Slice> {
        self.slice_of(self.find(id)?, tick_hz)
    }

    fn slice_of(&self, body: &Body, tick_hz: f64) -> Option<Slice> {
        let (mut q, mut v) = self.numbers(body, tick_hz);
        if body.parent.is_some() {
            let (world, rates) = self.motion(body, (&q, &v), tick_hz, CHAIN_MAX)?;
            q.splice(..7, world);
            v.splice(..6, rates);
        }
        // Steps are bounded, so these are far within single precision.
        let single = |numbers: Vec<f64>| numbers.into_iter().map(|x| x as f32).collect();
        let shown = |group| match group {
            Group::Rate => None,
            // Its numbers are those of a rotation.
            Group::Hinge => Some(Group::Rotation),
            group => Some(group),
        };
        let groups = self.groups(body).iter().filter_map(|state| shown(state.value.group));
        let (id, kind, tick) = (body.id, body.kind, self.tick_of(body, CHAIN_MAX)?);
        Some(Slice { id, kind, tick, groups: groups.collect(), q: single(q), v: single(v) })
    }

    /// Tick of the state of the body with this id.
    pub fn tick_of_body(&self, id: u32) -> Option<u64> {
        self.bodies.binary_search_by_key(&id, |body| body.id).ok().map(|at| self.ticks[at])
    }

    /// Tick of the state of a body, or of what it is attached to where that is older.
    fn tick_of(&self, body: &Body, chain: usize) -> Option<u64> {
        let at = self.bodies.binary_search_by_key(&body.id, |body| body.id).ok()?;
        let own = self.ticks[at];
        let Some(parent) = body.parent else { return Some(own) };
        Some(own.min(self.tick_of(self.find(parent)?, chain.checked_sub(1)?)?))
    }

    /// Q and Q' as coded: in the frame of what the body is attached to.
    fn numbers(&self, body: &Body, tick_hz: f64) -> (Vec<f64>, Vec<f64>) {
        let (mut q, mut tracked, mut told) = (Vec::new(), Vec::new(), Vec::new());
        for group in self.groups(body) {
            if group.value.group == Group::Rate {
                group.value.numbers(&self.precision, &mut told);
            } else {
                group.value.numbers(&self.precision, &mut q);
                tracked.extend(group.rate(&self.precision, tick_hz));
            }
        }
        (q, if told.is_empty() { tracked } else { told })
    }

    /// Motion in the world of a body with the numbers `q` and `v`; `None` where it, or what it is attached to, does not begin
    /// with a point and a rotation.
    fn motion(&self, body: &Body, (q, v): (&[f64], &[f64]), tick_hz: f64, chain: usize) -> Option<Motion> {
        let [point, turn, ..] = self.groups(body) else { return None };
        // Other numbers in their place are no unit quaternion, and grow along a chain beyond all bounds.
        let is_placed = (point.value.group, turn.value.group.numbers()) == (Group::Point, 4);
        let (q, v) = (*q.first_chunk::<7>()?, *v.first_chunk::<6>().filter(|_| is_placed)?);
        let Some(parent) = body.parent else { return Some((q, v)) };
        let parent = self.find(parent).filter(|parent| usize::from(parent.groups) <= CARRIER_GROUPS_MAX)?;
        let (parent_q, parent_v) = self.numbers(parent, tick_hz);
        let (frame, rates) = self.motion(parent, (&parent_q, &parent_v), tick_hz, chain.checked_sub(1)?)?;
        let turn = [frame[3], frame[4], frame[5], frame[6]];
        let world = absolute(&frame, &q);
        let arm = [world[0] - frame[0], world[1] - frame[1], world[2] - frame[2]];
        let spin = [rates[3], rates[4], rates[5]];
        let carried = [
            spin[1] * arm[2] - spin[2] * arm[1],
            spin[2] * arm[0] - spin[0] * arm[2],
            spin[0] * arm[1] - spin[1] * arm[0],
        ];
        let (linear, angular) = (rotate(turn, [v[0], v[1], v[2]]), rotate(turn, [v[3], v[4], v[5]]));
        let at = |i: usize| if i < 3 { rates[i] + carried[i] + linear[i] } else { rates[i] + angular[i - 3] };
        Some((world, [0, 1, 2, 3, 4, 5].map(at)))
    }
}
