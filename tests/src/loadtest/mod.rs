//! `pita-loadtest`: how many clients, or cars of its own, one server carries.
//!
//! Owns the ramp, its figures and how they are shown. Server and bots are processes of their own, so that CPU time is
//! accounted to who spends it; what a tick costs is what the server itself records.

pub mod bots;
pub mod course;
pub mod figures;
pub mod options;
pub mod plot;
pub mod ramp;
pub mod report;
pub mod server;

use std::path::PathBuf;

/// Bots whose inputs leave later than this (99th percentile, in ticks) starve for a core: half of their inputs would
/// miss the tick that they were meant for.
pub const STARVED_LATENESS_TICKS: f64 = 0.5;

/// The file of this program, to start it again in another role.
fn this_program() -> PathBuf {
    // Where the system does not say, the search path may know.
    std::env::current_exe().unwrap_or_else(|_| PathBuf::from("pita-loadtest"))
}
