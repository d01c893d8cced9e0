//! The arena's file is read again while it runs, on SIGHUP or for who knows the server's secret.
//!
//! Everything that can fail is done here; the tick thread is handed what changes nothing or everything.

use pita_game::ArenaSettings;
use pita_protocol::admin::{AdminAction, AdminReply};
use zenoh::Wait;

use crate::admin::Order;
use crate::arena_source::{ArenaText, SourceError};
use crate::config::ServerConfig;
use crate::shared::Shared;

/// The settings of the arena that `config` asks for.
pub fn settings(config: &ServerConfig) -> ArenaSettings {
    ArenaSettings { tick_hz: config.tick.tick_hz.hz(), threads: config.arena.threads.get() as usize }
}

/// Reads the arena again; answers whether it is as the file has it now, and what to tell who asked for it.
pub fn reload(config: &ServerConfig, shared: &Shared) -> (bool, Vec<String>) {
    match change(config, shared) {
        Ok(changes) if changes.is_empty() => (true, vec!["Arena: read again, nothing changed.".to_owned()]),
        Ok(changes) => (true, changes.iter().map(|change| format!("Arena: {change}")).collect()),
        Err(error) => (false, vec![format!("Arena: goes on as it is. {error}")]),
    }
}

/// Does what `order` says and answers who gave it; answers what to tell on the spot.
pub fn obey(order: &Order, config: &ServerConfig, shared: &Shared) -> Vec<String> {
    let AdminAction::Reload = order.action;
    let (done, said) = reload(config, shared);
    let answer = pita_protocol::encode(&AdminReply::answered(done, said.iter().cloned()));
    shared.counters.sent_bytes.add(answer.len() as u64);
    if let Err(reason) = order.query.reply(shared.keys.admin(), answer).wait() {
        tracing::debug!("reply to an order: {reason}");
    }
    said
}

fn change(config: &ServerConfig, shared: &Shared) -> Result<Vec<String>, SourceError> {
    let new = ArenaText::find(&config.arena.source, &config.arena.parameters)?;
    let reload = new.change_from(&shared.source().toml, &settings(config))?;
    let changes = reload.changes();
    // Refused only where the tick thread stands still: then nothing changed.
    if shared.reloads.push(reload).is_err() {
        return Ok(vec!["nothing changed: earlier changes still wait for a tick; ask again".to_owned()]);
    }
    // Whoever joins now may get the new text a tick before the new arena, which predicts his car no worse.
    shared.set_source(new.source());
    Ok(changes)
}
