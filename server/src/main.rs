//! The daemon's binary; everything is in the library, so that tests can start the same from theirs.

use std::process::ExitCode;

fn main() -> ExitCode {
    pita_server::run_from_args(std::env::args_os())
}
