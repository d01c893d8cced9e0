//! `pita-loadtest`: how many clients one server carries.
//!
//! Owns the ramp, its figures and how they are shown. Server and bots are processes of their own, so that CPU time is
//! accounted to who spends it; what a tick costs is what the server itself records.

pub mod figures;
pub mod plot;
pub mod report;

/// Bots whose inputs leave later than this (99th percentile, in ticks) starve for a core: half of their inputs would
/// miss the tick that they were meant for.
pub const STARVED_LATENESS_TICKS: f64 = 0.5;
