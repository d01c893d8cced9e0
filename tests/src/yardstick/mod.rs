//! The yardstick: small worlds that every engine is measured on, runners for ours and for rapier, and one judge.
//!
//! Owns the scenes (the same as the kit's `scenes.py` writes), how an engine is run on them, and what counts as
//! accepted (the same as the kit's `metrics.py` and `run.py` say; tests hold both together where the kit lies beside the
//! repository). SI units, y up, ticks of 1/30 s. It prints nothing and compares nothing: `bench::peers` does.

pub mod catalogue;
pub mod judge;
#[cfg(test)]
mod kit;
pub mod ours;
pub mod rapier;
pub mod scene;
pub mod trace;

/// Ticks a second of every scene.
pub const TICK_HZ: f64 = 30.0;
