//! `pita-bots`: see [`pita_client::bots::cli`].

fn main() -> std::process::ExitCode {
    pita_client::bots::cli::main()
}
