//! What people read: stdout and stderr, units.

use std::io::Write;
use std::process::ExitCode;

use pita_protocol::message::Status;

use crate::config::WhenBehind;
use crate::frame::Totals;

/// Prints `text` and a line end on stdout at once. Where stdout is closed, nobody reads it and the program goes on.
pub fn print(text: &str) {
    let mut out = std::io::stdout().lock();
    let _ = writeln!(out, "{text}").and_then(|()| out.flush());
}

/// Prints `text` as an error on stderr; the exit code is 1.
pub fn failure(text: &str) -> ExitCode {
    let _ = writeln!(std::io::stderr().lock(), "error: {text}");
    ExitCode::FAILURE
}

/// A rate of bytes with a unit that fits.
pub fn rate(bytes_per_s: f64) -> String {
    match bytes_per_s {
        b if b < 1e3 => format!("{b:.0} B/s"),
        b if b < 1e6 => format!("{:.1} kB/s", b / 1e3),
        b => format!("{:.2} MB/s", b / 1e6),
    }
}

/// What is said at the start, once clients can join.
pub fn welcome(endpoint: &str, status: &Status) -> String {
    let connect = match endpoint == pita_protocol::DEFAULT_ENDPOINT {
        true => String::new(),
        false => format!(" --connect {endpoint}"),
    };
    format!(
        "PITA {}: arena {} at {} Hz\n\
         listening on {endpoint}\n\n\
         In another terminal:\n\
         \x20 cargo run --release -p pita-client --bin pita-bots -- --count 8{connect}\n\
         \x20 cargo run --release -p pita-tests --bin pita-loadtest\n\
         \x20 cargo run --release -- status{connect}\n\
         Ctrl-C ends the server.\n",
        status.version, status.arena, status.tick_hz
    )
}

/// One line every few seconds.
pub fn status_line(status: &Status) -> String {
    format!(
        "tick {} | tick time p50 {:.2} ms, p99 {:.2} ms | clients {} | awake DOF {} | out {}, in {}",
        status.tick,
        status.tick_p50_ms,
        status.tick_p99_ms,
        status.clients,
        status.dof_awake,
        rate(status.sent_bytes_per_s),
        rate(status.received_bytes_per_s),
    )
}

/// What is said about ticks that took too long since `before`; nothing where none did.
pub fn overrun_line(before: &Totals, now: &Totals, when_behind: WhenBehind) -> Option<String> {
    let overruns = now.overruns - before.overruns;
    if overruns == 0 {
        return None;
    }
    let lost_ms = (now.given_up_ns - before.given_up_ns) / 1_000_000;
    let skipped = now.skipped_ticks - before.skipped_ticks;
    let done = match when_behind {
        WhenBehind::SlowDown => format!("every tick is simulated, the world fell {lost_ms} ms behind the clock"),
        WhenBehind::Skip => format!("{skipped} ticks left out, the world fell {lost_ms} ms further behind the clock"),
    };
    Some(format!("{overruns} ticks took longer than their period: {done}"))
}
