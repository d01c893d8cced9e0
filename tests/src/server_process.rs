//! A server as a process of its own, on a port of its own.

use std::process::Command;
use std::time::Duration;

use crate::process::{Process, ProcessError, Signal};

/// How long a server may take to listen, and to end.
pub const PATIENCE: Duration = Duration::from_secs(20);

/// What a server prints in front of its port.
const LISTENING: &str = "tcp/127.0.0.1:";

/// A running server; killed when dropped.
pub struct ServerProcess {
    /// The process.
    pub process: Process,
    /// Where it listens, such as `tcp/127.0.0.1:40123`.
    pub endpoint: String,
}

impl ServerProcess {
    /// Starts `command`, a `pita-server run`, on a free port, and waits until it says where it listens.
    ///
    /// # Errors
    /// [`ProcessError`] with everything that it printed.
    pub fn start(command: &mut Command) -> Result<Self, ProcessError> {
        command.args(["--listen", &format!("{LISTENING}0")]);
        let mut process = Process::start("the server", command)?;
        let line = process.line_with(LISTENING, PATIENCE)?;
        Ok(Self { endpoint: endpoint_in(&line), process })
    }

    /// Ends it in order.
    ///
    /// # Errors
    /// [`ProcessError`] where it does not end in time or not with success.
    pub fn stop(mut self) -> Result<(), ProcessError> {
        self.process.signal(Signal::TERM)?;
        self.process.wait_for_success(PATIENCE)
    }
}

/// The endpoint that a line of the server names.
fn endpoint_in(line: &str) -> String {
    let port = line.split(LISTENING).nth(1).unwrap_or_default();
    let digits = port.len() - port.trim_start_matches(|c: char| c.is_ascii_digit()).len();
    format!("{LISTENING}{}", &port[..digits])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_endpoint_is_found_in_a_sentence() {
        assert_eq!(endpoint_in("listening on tcp/127.0.0.1:40123 (arena proving-ground)"), "tcp/127.0.0.1:40123");
        assert_eq!(endpoint_in("tcp/127.0.0.1:7, done"), "tcp/127.0.0.1:7");
    }
}
