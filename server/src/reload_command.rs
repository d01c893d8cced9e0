//! `pita-server reload`: asks a running server to read its arena's file again.

use std::process::ExitCode;

use pita_protocol::admin::{AdminAction, AdminReply, AdminRequest};
use pita_protocol::message::Status;
use pita_protocol::seal::{self, SessionKey};
use pita_protocol::{Keys, keys};
use serde_json::json;

use crate::admin::{self, SecretError};
use crate::cli::ReloadArgs;
use crate::report;
use crate::status::{StatusError, connect, question};

/// Why nothing was asked for, or not done.
#[derive(Debug, thiserror::Error)]
enum ReloadError {
    /// No secret.
    #[error(transparent)]
    Secret(#[from] SecretError),
    /// No server, or no answer.
    #[error(transparent)]
    Server(#[from] StatusError),
    /// The server's arena has no name that can be asked for.
    #[error(transparent)]
    Arena(#[from] pita_protocol::WireError),
    /// Another secret, most likely.
    #[error("the server at {0} refuses: is it started with the same secret file?")]
    Refused(String),
}

/// Asks the server at `args.connect` and prints what it says.
pub fn run(args: &ReloadArgs) -> ExitCode {
    let runtime = match tokio::runtime::Builder::new_multi_thread().worker_threads(1).enable_all().build() {
        Ok(runtime) => runtime,
        Err(error) => return report::failure(&format!("cannot start threads: {error}")),
    };
    match runtime.block_on(ask(args)) {
        Ok((done, lines)) if args.json => {
            report::print(&format!("{:#}", json!({ "done": done, "said": lines })));
            ExitCode::from(u8::from(!done))
        }
        Ok((true, lines)) => {
            lines.iter().for_each(|line| report::print(line));
            ExitCode::SUCCESS
        }
        Ok((false, lines)) => report::failure(&lines.join("\n")),
        Err(error) => report::failure(&error.to_string()),
    }
}

/// Whether the arena was read, and what the server says.
async fn ask(args: &ReloadArgs) -> Result<(bool, Vec<String>), ReloadError> {
    let key = admin::read_secret(&args.secret_file)?;
    let session = connect(&args.connect).await?;
    let status: Status = question(&session, &args.connect, keys::ANY_STATUS, Vec::new()).await?;
    let on = Keys::new(&status.arena)?.admin();
    let send = async |request: AdminRequest, key: &SessionKey| {
        question::<AdminReply>(&session, &args.connect, &on, seal::seal(&request, key, &on)).await
    };
    let answer = match send(AdminRequest::Challenge, &key).await? {
        AdminReply::Challenge(challenge) => {
            send(AdminRequest::Do { challenge, action: AdminAction::Reload }, &key).await?
        }
        other => other,
    };
    match answer {
        AdminReply::Answered { done, lines } => Ok((done, lines)),
        AdminReply::Challenge(_) | AdminReply::Refused => Err(ReloadError::Refused(args.connect.clone())),
    }
}
