//! The interpolation buffer: states between, and shortly after, the ticks that were received.
//!
//! Pure. Frames may come in any order, more than once, and with gaps. Within a tick Q is linear and Q' constant (axiom 3
//! of the talk), so between neighbouring ticks linear positions are exact; orientations take the shortest arc.

mod playback;

use std::{collections::VecDeque, time::Duration};

use glam::{Quat, Vec3};
use pita_protocol::dof::{Slice, kind};

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

    /// Puts a frame in its place. A tick that is there already, or older than everything in a full buffer, is dropped.
    pub fn insert(&mut self, frame: Frame) {
        let place = self.frames.partition_point(|f| f.tick < frame.tick);
        let full = self.frames.len() == self.frames_max;
        let repeated = self.frames.get(place).is_some_and(|f| f.tick == frame.tick);
        if repeated || (full && place == 0) {
            return;
        }
        self.frames.insert(place, frame);
        if full {
            self.frames.pop_front();
        }
    }

    /// Ticks of the oldest and the newest frame.
    pub fn span(&self) -> Option<(u64, u64)> {
        Some((self.frames.front()?.tick, self.frames.back()?.tick))
    }

    /// The slices at a fractional tick, in order of id: interpolated between frames, carried on along Q' for a bounded
    /// time after the newest, and those of the oldest before it. `None` while there is no frame.
    pub fn sample(&self, tick: f64) -> Option<Vec<Slice>> {
        let after = self.frames.partition_point(|f| f.tick as f64 <= tick);
        let (oldest, newest) = (self.frames.front()?, self.frames.back()?);
        if after == 0 {
            return Some(oldest.slices.clone());
        }
        if after == self.frames.len() {
            let ticks = (tick - newest.tick as f64).clamp(0.0, self.extrapolation_max_ticks);
            let seconds = (ticks * self.period_s) as f32;
            return Some(newest.slices.iter().map(|slice| carried_on(slice, seconds)).collect());
        }
        let (a, b) = (&self.frames[after - 1], &self.frames[after]);
        let t = (tick - a.tick as f64) / (b.tick as f64 - a.tick as f64);
        Some(between(&a.slices, &b.slices, t as f32))
    }
}

/// Slices of `a`, moved by the fraction `t` towards their state in `b`. One that `b` lacks stays as it was; one that
/// only `b` has is not there yet. Both lists ascend by id.
fn between(a: &[Slice], b: &[Slice], t: f32) -> Vec<Slice> {
    let mut later = b.iter().peekable();
    let moved = a.iter().map(|from| {
        while later.next_if(|to| to.id < from.id).is_some() {}
        match later.peek() {
            Some(to) if to.id == from.id && to.kind == from.kind && to.q.len() == from.q.len() => {
                interpolated(from, to, t)
            }
            _ => from.clone(),
        }
    });
    moved.collect()
}

fn interpolated(a: &Slice, b: &Slice, t: f32) -> Slice {
    // Not a + t (b − a): the difference of two finite numbers may overflow, and their mean by rounding.
    let mix = |(&a, &b): (&f32, &f32)| (a * (1.0 - t) + b * t).clamp(f32::MIN, f32::MAX);
    let mut q: Vec<f32> = a.q.iter().zip(&b.q).map(mix).collect();
    if let (Some(from), Some(to)) = (rotation(a), rotation(b)) {
        q[3..7].copy_from_slice(&from.slerp(to, t).normalize().to_array());
    }
    // Q' is constant within a tick, and it is the later state's Q' that led there.
    Slice { id: a.id, kind: a.kind, q, v: b.v.clone() }
}

fn carried_on(slice: &Slice, seconds: f32) -> Slice {
    let mut moved = slice.clone();
    let positions = if slice.kind == kind::RIGID_BODY { 3 } else { slice.q.len() };
    for (q, v) in moved.q.iter_mut().zip(&slice.v).take(positions) {
        *q = (*q + v * seconds).clamp(f32::MIN, f32::MAX);
    }
    if let (Some(rotation), Some(spin)) = (rotation(slice), slice.v.get(3..6)) {
        let turn = Quat::from_scaled_axis(Vec3::from_slice(spin) * seconds);
        let turned = (turn * rotation).normalize();
        if turned.is_finite() {
            moved.q[3..7].copy_from_slice(&turned.to_array());
        }
    }
    moved
}

/// Unit quaternion of a rigid body; the identity where the numbers are none.
fn rotation(slice: &Slice) -> Option<Quat> {
    if slice.kind != kind::RIGID_BODY {
        return None;
    }
    let numbers = slice.q.get(3..7)?;
    let unit = Quat::from_slice(numbers).normalize();
    Some(if unit.is_finite() && unit.is_normalized() { unit } else { Quat::IDENTITY })
}

#[cfg(test)]
mod tests;
