//! PITA's daemon: runs an arena in real time and serves it over Zenoh.
//!
//! ```text
//!            Zenoh's threads                 publishing thread                tick thread
//!  inputs ──▶ inputs::receive ── InputQueue ─────────────────────────────▶ 1 input
//!  tokens ──▶ Sessions ── Change ──▶ publish ── Boarding ───────────────▶   │ 2 collision, 3 logic,
//!  queries ─▶ answering thread ◀── Admitted ──┘ ▲                           │ 4 integration
//!                                    snapshots, └──────────── Frame ◀────── 5 output
//!                                    events
//! ```
//!
//! The tick thread ([`tick_thread`]) waits for its next tick and for nothing else. Queues between threads are bounded
//! and lock-free; locks are shared only by threads that serve the network. Pure, and tested without threads: sessions
//! ([`sessions`]), what is sent to whom ([`cells`]), pacing ([`pacer`]), controls ([`drivers`]), matching of players and sessions ([`boarding`]).

pub mod admin;
pub mod answers;
pub mod arena_source;
pub mod boarding;
pub mod cells;
pub mod check;
pub mod cli;
pub mod config;
pub mod counters;
pub mod crowd;
pub mod daemon;
pub mod description;
pub mod drivers;
pub mod event_backlog;
pub mod files;
pub mod frame;
pub mod inputs;
pub mod metrics;
pub mod network;
pub mod output;
pub mod pacer;
pub mod publish;
mod reload_command;
pub mod report;
pub mod sessions;
pub mod shared;
pub mod simulate;
pub mod status;
pub mod stopwatch;
pub mod tick_thread;
pub mod trace;

use std::ffi::OsString;
use std::process::ExitCode;

use clap::Parser;

/// `pita-server` as a function: parses `args`, the program's name first, and does what they say.
pub fn run_from_args(args: impl IntoIterator<Item = OsString>) -> ExitCode {
    match cli::Cli::try_parse_from(args) {
        Ok(cli) => cli.execute(),
        Err(error) => {
            // Help and version come here too. Where stdout is closed there is nobody to be told.
            let _ = error.print();
            ExitCode::from(u8::try_from(error.exit_code()).unwrap_or(2))
        }
    }
}
