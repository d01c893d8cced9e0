//! Programs that are run to their end.

use std::process::Command;

use pita_tests::process::Process;

use crate::LONG;

/// How a program ended, and what it printed.
pub struct Ended {
    pub success: bool,
    pub said: String,
}

/// Runs to the end, within bounds.
pub fn run(command: &mut Command) -> Ended {
    let mut process = Process::start("the program", command).unwrap_or_else(|error| panic!("{error}"));
    let status = process.wait(LONG).unwrap_or_else(|error| panic!("{error}"));
    Ended { success: status.success(), said: process.output() }
}

/// A port on which nobody listens, most likely.
pub fn free_port() -> u16 {
    std::net::TcpListener::bind(("127.0.0.1", 0)).unwrap().local_addr().unwrap().port()
}
