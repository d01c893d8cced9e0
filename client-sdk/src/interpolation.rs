//! The interpolation buffer: states between, and shortly after, the ticks that were received.
//!
//! Pure. Frames may come in any order, more than once, and with gaps. Within a tick Q is linear and Q' constant (axiom 3
//! of the talk), so between neighbouring ticks linear positions are exact; orientations take the shortest arc.

mod playback;

use std::{collections::VecDeque, time::Duration};

use glam::{Quat, Vec3};
use pita_protocol::dof::{Group, Slice};

pub(crate) use playback::Playback;

/// How a session turns snapshots into what is drawn.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct InterpolationSettings {
    /// How far behind the newest state is shown, at least. Less than the usual gap between snapshots makes motion guess;
    /// more delays what the player sees.
    pub delay: Duration,
    /// The same, at most. In between the delay follows how late snapshots come.
    pub delay_max: Duration,
    /// How long states are carried on along Q' when nothing newer came; then they stand still.
    pub extrapolation_max: Duration,
    /// Most frames that are kept, 2 to 256. Older ones are dropped first.
    pub frames_max: usize,
}

impl Default for InterpolationSettings {
    /// From little more than a tick of delay at 30 Hz to what a bad network asks for; a quarter of a second of guessing.
    fn default() -> Self {
        let [delay, delay_max] = [40, 300].map(Duration::from_millis);
        Self { delay, delay_max, extrapolation_max: Duration::from_millis(250), frames_max: 16 }
    }
}

impl InterpolationSettings {
    /// [`Self::frames_max`] in its range.
    pub(crate) fn frames_max(&self) -> usize {
        self.frames_max.clamp(2, 256)
    }
}

/// The slices after one tick, in order of id.
#[derive(Clone, Debug, PartialEq)]
pub struct Frame {
    /// Tick whose end this is.
    pub tick: u64,
    /// In order of id.
    pub slices: Vec<Slice>,
}

/// Received frames, in order of tick.
#[derive(Clone, Debug)]
pub struct InterpolationBuffer {
    frames: VecDeque<Frame>,
    frames_max: usize,
    extrapolation_max_ticks: f64,
    period_s: f64,
}

impl InterpolationBuffer {
    /// Empty buffer for ticks of `period_s`.
    pub fn new(settings: InterpolationSettings, period_s: f64) -> Self {
        Self {
            frames: VecDeque::new(),
            frames_max: settings.frames_max(),
            extrapolation_max_ticks: settings.extrapolation_max.as_secs_f64() / period_s,
            period_s,
        }
    }

    /// Puts a frame in its place, instead of what is known of its tick. What is older than everything in a full buffer is
    /// dropped.
    pub fn insert(&mut self, frame: Frame) {
        let place = self.frames.partition_point(|f| f.tick < frame.tick);
        let full = self.frames.len() == self.frames_max;
        match self.frames.get_mut(place) {
            Some(known) if known.tick == frame.tick => *known = frame,
            _ if full && place == 0 => {}
            _ => {
                self.frames.insert(place, frame);
                if full {
                    self.frames.pop_front();
                }
            }
        }
    }

    /// Ticks of the oldest and the newest frame.
    pub fn span(&self) -> Option<(u64, u64)> {
        Some((self.frames.front()?.tick, self.frames.back()?.tick))
    }

    /// The slices at a fractional tick, in order of id: between two of their states, carried on along Q' for a bounded
    /// time after the newest, and as in the oldest frame before it. A frame that did not carry a body knows it by an older
    /// state, which counts only once. `None` while there is no frame.
    pub fn sample(&self, tick: f64) -> Option<Vec<Slice>> {
        let after = self.frames.partition_point(|f| f.tick as f64 <= tick);
        let oldest = self.frames.front()?;
        if after == 0 {
            return Some(oldest.slices.clone());
        }
        let (present, later) = (&self.frames[after - 1], self.frames.range(after..));
        let mut later: Vec<_> = later.map(|frame| frame.slices.as_slice()).collect();
        Some(present.slices.iter().map(|from| self.shown(from, &mut later, tick)).collect())
    }

    /// `from` at `tick`. In `later` are the frames behind, in order, without what was passed already: ids ascend.
    fn shown(&self, from: &Slice, later: &mut [&[Slice]], tick: f64) -> Slice {
        let mut newer = None;
        for frame in later {
            *frame = &frame[frame.iter().position(|to| to.id >= from.id).unwrap_or(frame.len())..];
            let Some(to) = frame.first().filter(|to| to.id == from.id) else {
                // It is gone then.
                return from.clone();
            };
            if to.tick > from.tick {
                newer = Some(to);
                break;
            }
        }
        match newer {
            Some(to) if to.kind == from.kind && to.groups == from.groups => {
                interpolated(from, to, ((tick - from.tick as f64) / (to.tick - from.tick) as f64) as f32)
            }
            Some(_) => from.clone(),
            None => {
                // Back, too: a cell may be ahead of the snapshot with which it is shown.
                let most = self.extrapolation_max_ticks;
                let ticks = (tick - from.tick as f64).clamp(-most, most);
                carried_on(from, (ticks * self.period_s) as f32)
            }
        }
    }
}

/// The slice moved by the fraction `t` towards its state in `b`, which has the same groups.
fn interpolated(a: &Slice, b: &Slice, t: f32) -> Slice {
    // Not a + t (b − a): the difference of two finite numbers may overflow, and their mean by rounding.
    let mix = |(&a, &b): (&f32, &f32)| (a * (1.0 - t) + b * t).clamp(f32::MIN, f32::MAX);
    let mut q: Vec<f32> = a.q.iter().zip(&b.q).map(mix).collect();
    for (_, at, _) in places(a).filter(|(group, ..)| *group == Group::Rotation) {
        if let (Some(from), Some(to), Some(shown)) = (a.q.get(at..at + 4), b.q.get(at..at + 4), q.get_mut(at..at + 4)) {
            shown.copy_from_slice(&rotation(from).slerp(rotation(to), t).normalize().to_array());
        }
    }
    // Q' is constant within a tick, and it is the later state's Q' that led there.
    Slice { q, v: b.v.clone(), ..a.clone() }
}

/// Q' that leads from one state of a slice to a later one, a tick being `period_s`; `None` where they are not that.
pub(crate) fn rates_between(from: &Slice, to: &Slice, period_s: f64) -> Option<Vec<f32>> {
    let components: usize = to.groups.iter().map(|group| group.components()).sum();
    if from.groups != to.groups || to.tick <= from.tick || to.v.len() != components {
        return None;
    }
    let seconds = ((to.tick - from.tick) as f64 * period_s) as f32;
    let mut rates = Vec::with_capacity(components);
    for (group, at, _) in places(to) {
        let (a, b) = (from.q.get(at..at + group.numbers())?, to.q.get(at..at + group.numbers())?);
        if group == Group::Rotation {
            let turn = rotation(b) * rotation(a).inverse();
            // The shorter way.
            let turn = if turn.w < 0.0 { -turn } else { turn };
            rates.extend((turn.to_scaled_axis() / seconds).to_array());
        } else {
            rates.extend(a.iter().zip(b).map(|(a, b)| (b - a) / seconds));
        }
    }
    Some(rates)
}

fn carried_on(slice: &Slice, seconds: f32) -> Slice {
    let mut moved = slice.clone();
    for (group, at, rate) in places(slice) {
        let (numbers, components) = (group.numbers(), group.components());
        let (Some(q), Some(v)) = (moved.q.get_mut(at..at + numbers), slice.v.get(rate..rate + components)) else {
            break;
        };
        if group == Group::Rotation {
            let turn = Quat::from_scaled_axis(Vec3::from_slice(v) * seconds);
            let turned = (turn * rotation(q)).normalize();
            if turned.is_finite() {
                q.copy_from_slice(&turned.to_array());
            }
        } else {
            q.iter_mut().zip(v).for_each(|(q, v)| *q = (*q + v * seconds).clamp(f32::MIN, f32::MAX));
        }
    }
    moved
}

/// The groups of a slice, each with where its numbers start in Q and in Q'.
fn places(slice: &Slice) -> impl Iterator<Item = (Group, usize, usize)> {
    slice.groups.iter().scan((0, 0), |(q, v), &group| {
        let place = (group, *q, *v);
        (*q, *v) = (*q + group.numbers(), *v + group.components());
        Some(place)
    })
}

/// Unit quaternion of four numbers; the identity where they are none.
fn rotation(numbers: &[f32]) -> Quat {
    let unit = Quat::from_slice(numbers).normalize();
    if unit.is_finite() && unit.is_normalized() { unit } else { Quat::IDENTITY }
}

#[cfg(test)]
mod tests;
