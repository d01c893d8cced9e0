//! The watchdog: lets a Newton step be as long as it wants to be where joints are what shortens it, and goes back where
//! that was no good.
//!
//! What is held at a distance moves along an arc, a step goes along its tangent: at the end of it every joint is stretched
//! a little, and against its stiffness the line search sees a wall. Walking up to the wall takes tiny steps for ever (the
//! Maratos effect; Nocedal and Wright, "Numerical Optimization", 15.5), while the next Newton step would close the
//! joints and stay. A frame of rods that tumbles at 3 rad/s takes 2 to 5 iterations with the watchdog and does not come
//! to an end without.

use super::super::block::Entry;

/// Steps of a trial.
const STEPS: u8 = 2;

/// More steps that it gets as long as each shrinks the residual to [`CONVERGING`] of the last.
const MORE_STEPS: u8 = 4;

/// Newton's method does better than this near its goal.
const CONVERGING: f64 = 0.25;

/// A trial is good if it shrinks the residual to this fraction, ...
const SHRINK: f64 = 0.5;

/// ... or the incremental potential by this share of its slope along the first step. The model promises half of that.
const GAIN: f64 = 0.25;

/// How good a state is.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Standing {
    /// Incremental potential, J.
    pub merit: f64,
    /// m/s.
    pub residual: f64,
}

/// The watchdog of a solve.
#[derive(Default)]
pub(super) struct Watchdog<const D: usize> {
    /// It has gone back before, or has nothing to do in this solve.
    tired: bool,
    is_on: bool,
    steps: u8,
    /// Residual after the last step, m/s.
    last: f64,
    /// Where the trial began, and the step that it began with.
    u: Vec<Entry<D>>,
    step: Vec<Entry<D>>,
    start: Standing,
    slopes: Slopes,
}

/// Of the incremental potential along a step, J.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Slopes {
    /// Where it starts, negative.
    pub start: f64,
    /// Where it ends.
    pub end: f64,
}

/// What becomes of a trial.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Verdict {
    /// There is none, it is not over yet, or it was good.
    GoOn,
    /// Back to its start.
    GoBack,
}

impl<const D: usize> Watchdog<D> {
    /// Starts a solve; `watches` says whether there is something to watch.
    pub fn begin(&mut self, watches: bool) {
        (self.tired, self.is_on) = (!watches, false);
    }

    /// Whether the next step is to be taken in full.
    pub fn is_bold(&self) -> bool {
        !self.tired
    }

    /// Hears that a full step from `u`, along which the potential had these `slopes`, led to where a line search would have
    /// shortened it.
    pub fn overstepped(&mut self, u: &[Entry<D>], start: Standing, step: &[Entry<D>], slopes: Slopes) {
        if !self.is_on {
            self.u.clear();
            self.u.extend_from_slice(u);
            self.step.clear();
            self.step.extend_from_slice(step);
            (self.start, self.slopes) = (start, slopes);
            (self.is_on, self.steps) = (true, 0);
        }
    }

    /// Hears where a step led.
    pub fn judge(&mut self, now: Standing) -> Verdict {
        if !self.is_on {
            return Verdict::GoOn;
        }
        self.steps += 1;
        let gained = now.merit < self.start.merit + GAIN * self.slopes.start;
        let good = gained || now.residual < SHRINK * self.start.residual;
        let converges = now.residual < CONVERGING * std::mem::replace(&mut self.last, now.residual);
        let goes_on = self.steps < STEPS || self.steps < STEPS + MORE_STEPS && converges;
        self.is_on = !good && goes_on;
        if good || goes_on { Verdict::GoOn } else { Verdict::GoBack }
    }

    /// Where the trial began, and its first step; it has been the last one.
    pub fn go_back(&mut self) -> (&[Entry<D>], &[Entry<D>], Slopes) {
        self.tired = true;
        (&self.u, &self.step, self.slopes)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const SLOPES: Slopes = Slopes { start: -1.0, end: 1.0 };

    fn at(merit: f64, residual: f64) -> Standing {
        Standing { merit, residual }
    }

    #[test]
    fn a_trial_has_two_steps_to_become_good() {
        let mut dog = Watchdog::<3>::default();
        dog.begin(true);
        assert_eq!(dog.judge(at(9.0, 9.0)), Verdict::GoOn);
        for good in [at(9.0, 0.4), at(0.7, 9.0)] {
            dog.overstepped(&[[1.0; 3]], at(1.0, 1.0), &[[2.0; 3]], SLOPES);
            assert_eq!(dog.judge(at(9.0, 9.0)), Verdict::GoOn);
            assert_eq!(dog.judge(good), Verdict::GoOn);
        }
        dog.overstepped(&[[3.0; 3]], at(1.0, 1.0), &[[4.0; 3]], SLOPES);
        assert_eq!(dog.judge(at(9.0, 9.0)), Verdict::GoOn);
        dog.overstepped(&[[5.0; 3]], at(9.0, 9.0), &[[6.0; 3]], SLOPES);
        assert_eq!(dog.judge(at(0.8, 0.8)), Verdict::GoOn, "it converges");
        assert_eq!(dog.judge(at(0.8, 0.6)), Verdict::GoBack);
        assert!(dog.is_bold());
        let (u, step, _) = dog.go_back();
        assert_eq!((u, step), (&[[3.0; 3]][..], &[[4.0; 3]][..]));
        assert!(!dog.is_bold());
    }
}
