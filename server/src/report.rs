//! What people read: stdout and stderr, units.

use std::io::Write;
use std::process::ExitCode;

use pita_protocol::message::Status;

use crate::config::WhenBehind;
use crate::frame::Totals;
use crate::network::Endpoints;
use crate::shared::Shared;

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
pub fn welcome(endpoints: &Endpoints, status: &Status) -> String {
    let endpoint = &endpoints.control;
    let connect = match endpoint == pita_protocol::DEFAULT_ENDPOINT {
        true => String::new(),
        false => format!(" --connect {endpoint}"),
    };
    let datagrams = match &endpoints.datagrams {
        None => String::new(),
        Some(datagrams) => format!("\nsnapshots as datagrams on {datagrams}"),
    };
    format!(
        "PITA {}: arena {} at {} Hz\n\
         listening on {endpoint}{datagrams}\n\n\
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

/// What went wrong since the start, of all that is told.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Troubles {
    /// Of the ticks.
    pub totals: Totals,
    /// Frames that were not published, because a newer one waited already.
    pub frames_superseded: u64,
    /// Queries that were not answered, because too many waited.
    pub queries_dropped: u64,
}

impl Troubles {
    /// As of now.
    pub fn of(shared: &Shared) -> Self {
        Self {
            totals: shared.metrics().totals(),
            frames_superseded: shared.counters.frames_superseded.get(),
            queries_dropped: shared.counters.queries_dropped.get(),
        }
    }

    fn unpublished(&self) -> u64 {
        self.totals.frames_missed + self.frames_superseded
    }
}

/// What is said about trouble since `earlier`, a line each; nothing where there was none.
pub fn trouble(earlier: &Troubles, latest: &Troubles, when_behind: WhenBehind) -> Vec<String> {
    let mut lines = Vec::new();
    let (before, now) = (&earlier.totals, &latest.totals);
    let overruns = now.overruns - before.overruns;
    let lost_ms = (now.given_up_ns - before.given_up_ns) / 1_000_000;
    let skipped = now.skipped_ticks - before.skipped_ticks;
    if overruns + lost_ms + skipped > 0 {
        let done = match when_behind {
            WhenBehind::SlowDown => "every tick is simulated".to_owned(),
            WhenBehind::Skip => format!("{skipped} ticks were left out"),
        };
        lines.push(format!(
            "behind: {overruns} ticks took longer than their period, {done}, the world fell {lost_ms} ms behind the clock"
        ));
    }
    let unpublished = latest.unpublished() - earlier.unpublished();
    if unpublished > 0 {
        lines.push(format!("behind: {unpublished} ticks were not published, because publishing did not keep up"));
    }
    let untold = now.events_dropped - before.events_dropped;
    if untold > 0 {
        lines.push(format!("behind: {untold} events were not told, because publishing did not keep up"));
    }
    let dropped = latest.queries_dropped - earlier.queries_dropped;
    if dropped > 0 {
        lines.push(format!("behind: {dropped} queries were not answered, because too many waited"));
    }
    let quarantined = now.quarantined - before.quarantined;
    if quarantined > 0 {
        lines.push(format!("quarantined: the state of {quarantined} bodies was not finite and has been frozen"));
    }
    lines
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_new_trouble_is_told() {
        let ticks = Totals { overruns: 5, given_up_ns: 7_000_000, ..Totals::default() };
        let before = Troubles { totals: ticks, queries_dropped: 3, ..Troubles::default() };
        assert_eq!(trouble(&before, &before, WhenBehind::SlowDown), Vec::<String>::new());
        let totals = Totals {
            overruns: 7,
            given_up_ns: 90_000_000,
            frames_missed: 4,
            events_dropped: 9,
            quarantined: 1,
            ..ticks
        };
        let now = Troubles { totals, frames_superseded: 2, queries_dropped: 8 };
        let lines = trouble(&before, &now, WhenBehind::SlowDown);
        assert_eq!(lines.len(), 5);
        assert!(lines[1].contains("6 ticks were not published") && lines[2].contains("9 events"), "{lines:?}");
        assert!(lines[3].contains("5 queries"), "{lines:?}");
        assert!(lines[0].contains("2 ticks") && lines[0].contains("83 ms"), "{lines:?}");
        let skipping =
            trouble(&before, &Troubles { totals: Totals { skipped_ticks: 3, ..ticks }, ..before }, WhenBehind::Skip);
        assert!(skipping[0].contains("3 ticks were left out"), "{skipping:?}");
    }

    #[test]
    fn rates_have_a_unit_that_fits() {
        assert_eq!([0.0, 999.0, 1500.0, 2.5e6].map(rate), ["0 B/s", "999 B/s", "1.5 kB/s", "2.50 MB/s"]);
    }
}
