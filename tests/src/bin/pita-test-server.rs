//! `pita-server` under another name: the tests of this package can only start this package's own binaries.

use std::process::ExitCode;

fn main() -> ExitCode {
    pita_server::run_from_args(std::env::args_os())
}
