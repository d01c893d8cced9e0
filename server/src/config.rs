//! `server.toml`: every key with its unit and range.
//!
//! Owns the daemon's configuration and its defaults, which are the text of `configs/server.toml` itself, compiled in.
//! A given file is laid over the defaults key by key, so that it needs only what it changes.

mod within;

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use pita_game::arena_file::PrecisionFile;
use pita_protocol::dof::{Cadence, Precision, STEPS_MAX};
use serde::Deserialize;

use crate::files;
pub use within::{KeyframeTicks, TickRate, Within};

/// The defaults, and the documentation of every key.
pub const DEFAULT_TEXT: &str = include_str!("../../configs/server.toml");

/// Name under which errors speak of [`DEFAULT_TEXT`].
pub const BUILT_IN: &str = "built-in server.toml";

/// Longest file, bytes.
const FILE_MAX: usize = 1 << 20;

/// The whole file.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ServerConfig {
    /// Zenoh.
    pub network: Network,
    /// What is simulated.
    pub arena: ArenaChoice,
    /// Pacing.
    pub tick: Tick,
    /// How fine the state is sent.
    pub precision: PrecisionSteps,
    /// How the world is divided for those who look at it.
    pub cells: CellSettings,
    /// Slots and timeouts.
    pub sessions: SessionLimits,
    /// Who stays out.
    pub bans: Bans,
    /// Who runs the server.
    pub admin: Admin,
    /// What is said on stdout.
    pub report: Report,
}

/// `[network]`
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Network {
    /// Endpoint to listen on.
    pub listen: String,
    /// Endpoint for snapshots as datagrams; empty for none.
    pub datagrams: String,
    /// Silence after which a connection is closed, ms.
    pub lease_ms: Within<500, 60_000>,
    /// Connections at once.
    pub connections_max: Within<1, 10_000>,
    /// Longest message that is received, bytes.
    pub message_bytes_max: Within<4096, 1_048_576>,
    /// Most that one client is sent of the state, bytes/s.
    pub client_bytes_per_s: Within<8_000, 10_000_000>,
    /// Highest rate of one player's inputs over one connection, Hz.
    pub input_rate_max_hz: Within<60, 100_000>,
}

/// `[arena]`
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ArenaChoice {
    /// Built-in name or path.
    pub source: String,
    /// What is chosen of the arena's parameters, by name.
    pub parameters: BTreeMap<String, i64>,
    /// Threads that integrate.
    pub threads: Within<1, 64>,
}

/// `[tick]`
#[derive(Clone, Copy, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Tick {
    /// Ticks a second.
    pub tick_hz: TickRate,
    /// What to do when ticks take longer than their period.
    pub when_behind: WhenBehind,
    /// Ticks to catch up or to skip at once.
    pub behind_ticks_max: Within<0, 300>,
}

/// What a pacer does about missed ticks.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum WhenBehind {
    /// Every tick is simulated; late ones follow each other without a pause.
    SlowDown,
    /// Ticks missed by a whole period are left out, their numbers with them.
    Skip,
}

/// `[precision]`
#[derive(Clone, Copy, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct PrecisionSteps {
    /// Steps of a metre of positions.
    pub steps_per_m: Within<10, 65_536>,
    /// Steps of 1 of quaternion components.
    pub rotation_steps: Within<64, 8192>,
    /// Steps of a metre or radian of joint coordinates.
    pub joint_steps: Within<10, 65_536>,
}

/// Steps of a metre that the wire can carry as far as `reach_m` from the origin, at most.
pub fn steps_per_m_max(reach_m: f64) -> u32 {
    (f64::from(STEPS_MAX) / reach_m.max(1.0)) as u32
}

impl PrecisionSteps {
    /// The precision of an arena whose file wants `own`, which goes first.
    pub fn of_arena(self, own: PrecisionFile) -> Precision {
        let default = Precision::from(self);
        let PrecisionFile { steps_per_m, rotation_steps, joint_steps } = own;
        let (point, rotation) = (steps_per_m.unwrap_or(default.point), rotation_steps.unwrap_or(default.rotation));
        Precision { point, rotation, scalar: joint_steps.unwrap_or(default.scalar), ..default }
    }

    /// Checks that the steps of positions cover an arena whose bodies come as far as `reach_m` from the origin.
    ///
    /// # Errors
    /// [`ConfigError::Key`], which calls the configuration `file`.
    pub fn check_reach(&self, reach_m: f64, file: &str) -> Result<(), ConfigError> {
        let steps = self.steps_per_m.get();
        let most = steps_per_m_max(reach_m);
        if steps <= most {
            return Ok(());
        }
        Err(ConfigError::Key {
            file: file.to_owned(),
            key: "precision.steps_per_m".to_owned(),
            reason: format!(
                "{steps} steps a metre reach {:.0} m from the origin, and the arena's bounds {reach_m} m: allowed is 10 to \
                 {most}, or bounds that are nearer",
                f64::from(STEPS_MAX) / f64::from(steps)
            ),
        })
    }
}

impl From<PrecisionSteps> for Precision {
    fn from(steps: PrecisionSteps) -> Self {
        let (point, rotation) = (steps.steps_per_m.get(), steps.rotation_steps.get());
        Self { point, rotation, scalar: steps.joint_steps.get(), ..Self::default() }
    }
}

/// `[cells]`
#[derive(Clone, Copy, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct CellSettings {
    /// Side of a cell, m.
    pub side_m: Within<8, 4096>,
    /// Most that one cell takes, bytes/s.
    pub bytes_per_s: Within<1_000, 10_000_000>,
    /// Ticks from one keyframe to the next.
    pub keyframe_ticks: KeyframeTicks,
    /// Keyframes after which a cell begins anew.
    pub epoch_keyframes: Within<1, 100>,
}

impl CellSettings {
    /// For cells of a world of `tick_hz`.
    pub fn at(self, tick_hz: u16) -> crate::cells::Settings {
        let epoch_keyframes = self.epoch_keyframes.get() as usize;
        crate::cells::Settings {
            side_m: self.side_m.get() as f32,
            cadence: Cadence { keyframe_ticks_log2: self.keyframe_ticks.log2(), epoch_keyframes, ..Cadence::default() },
            bytes_per_s: self.bytes_per_s.get(),
            tick_hz,
        }
    }
}

/// `[sessions]`
#[derive(Clone, Copy, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SessionLimits {
    /// Slots of players.
    pub players_max: Within<1, 1024>,
    /// Slots of spectators.
    pub spectators_max: Within<0, 1024>,
    /// A player without input for so long is put out, ms.
    pub input_timeout_ms: Within<500, 600_000>,
    /// A player whose connection is lost keeps slot and car for so long, ms.
    pub resume_grace_ms: Within<0, 600_000>,
    /// After so long without input the controls are let go, ms.
    pub coast_after_ms: Within<50, 60_000>,
    /// Inputs of one session that are looked at between two ticks.
    pub inputs_per_tick_max: Within<8, 1000>,
}

/// `[bans]`
#[derive(Clone, Debug, Default, PartialEq, Eq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Bans {
    /// Names that are refused.
    pub names: Vec<String>,
}

/// `[admin]`
#[derive(Clone, Debug, Default, PartialEq, Eq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Admin {
    /// File of the secret under which admin requests are sealed; empty for none.
    pub secret_file: PathBuf,
}

/// `[report]`
#[derive(Clone, Copy, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Report {
    /// Time between two status lines, s.
    pub status_line_s: Within<1, 3600>,
}

/// Why there is no configuration.
#[derive(Debug, thiserror::Error)]
pub enum ConfigError {
    /// The file cannot be read.
    #[error("{}: {reason}", file.display())]
    Unreadable {
        /// The file.
        file: PathBuf,
        /// Why.
        reason: std::io::Error,
    },
    /// The file is no TOML.
    #[error("{file}: {reason}")]
    Syntax {
        /// The file.
        file: String,
        /// Line, column and cause.
        reason: String,
    },
    /// A key is unknown, or its value is not allowed.
    #[error("{file}: {key}: {reason}")]
    Key {
        /// The file.
        file: String,
        /// Path of the key, `tick.tick_hz`.
        key: String,
        /// The value and what is allowed.
        reason: String,
    },
}

impl ServerConfig {
    /// The compiled-in configuration.
    pub fn built_in() -> Self {
        // A unit test parses this very text.
        Self::parse(DEFAULT_TEXT, BUILT_IN).expect("the compiled-in configuration is valid")
    }

    /// Reads and checks `file`.
    ///
    /// # Errors
    /// [`ConfigError`] naming file, key, value and allowed range.
    pub fn from_file(file: &Path) -> Result<Self, ConfigError> {
        let unreadable = |reason| ConfigError::Unreadable { file: file.to_owned(), reason };
        Self::parse(&files::read_text(file, FILE_MAX).map_err(unreadable)?, &file.display().to_string())
    }

    /// Checks `text`, laid over the defaults; errors call it `file`.
    ///
    /// # Errors
    /// [`ConfigError::Syntax`] and [`ConfigError::Key`].
    pub fn parse(text: &str, file: &str) -> Result<Self, ConfigError> {
        let syntax = |e: toml::de::Error| ConfigError::Syntax { file: file.to_owned(), reason: e.to_string() };
        let given: toml::Table = text.parse().map_err(syntax)?;
        let mut merged: toml::Table = DEFAULT_TEXT.parse().map_err(syntax)?;
        overlay(&mut merged, given);
        let config = Self::deserialize(toml::Value::Table(merged)).map_err(|e| key_error(file, &e))?;
        crate::network::check_endpoints(&config.network).map_err(|(key, reason)| ConfigError::Key {
            file: file.to_owned(),
            key: key.to_owned(),
            reason,
        })?;
        Ok(config)
    }
}

/// Lays `given` over `base`, tables into tables, anything else instead of what was there.
fn overlay(base: &mut toml::Table, given: toml::Table) {
    for (key, value) in given {
        match (base.get_mut(&key), value) {
            (Some(toml::Value::Table(below)), toml::Value::Table(above)) => overlay(below, above),
            (_, value) => {
                base.insert(key, value);
            }
        }
    }
}

/// Takes apart what toml says of a value: the cause, and behind it "in `path.of.key`".
fn key_error(file: &str, error: &toml::de::Error) -> ConfigError {
    let text = error.to_string();
    let path = text.split_once("\nin `").and_then(|(_, rest)| rest.split_once('`')).map(|(path, _)| path);
    ConfigError::Key {
        file: file.to_owned(),
        key: path.unwrap_or("top level").to_owned(),
        reason: error.message().to_owned(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn refusal(text: &str) -> String {
        ServerConfig::parse(text, "my.toml").expect_err(text).to_string()
    }

    #[test]
    fn the_compiled_in_text_is_valid_and_a_file_changes_only_what_it_names() {
        let built_in = ServerConfig::built_in();
        let changed = ServerConfig::parse("[tick]\ntick_hz = 25", "my.toml").unwrap();
        assert_eq!(changed.tick.tick_hz.hz(), 25);
        assert_eq!(ServerConfig { tick: built_in.tick, ..changed }, built_in);
    }

    /// What is compiled in is what the wire takes where nothing is said.
    #[test]
    fn the_default_precision_and_cadence_are_the_protocols() {
        assert_eq!(ServerConfig::built_in().cells.at(30).cadence, Cadence::default());
        assert_eq!(Precision::from(ServerConfig::built_in().precision), Precision::default());
    }

    #[test]
    fn positions_have_to_cover_the_arena() {
        let config = ServerConfig::parse("[precision]\nsteps_per_m = 20000", "my.toml").unwrap();
        assert!(config.precision.check_reach(3000.0, "my.toml").is_ok());
        let said = config.precision.check_reach(5000.0, "my.toml").unwrap_err().to_string();
        for word in ["my.toml", "precision.steps_per_m", "20000", "5000 m", "10 to 13421"] {
            assert!(said.contains(word), "{said:?} lacks {word:?}");
        }
    }

    #[test]
    fn an_arena_s_own_precision_goes_first() {
        let config = ServerConfig::parse("[precision]\nsteps_per_m = 700\njoint_steps = 800", "my.toml").unwrap();
        let own = PrecisionFile { steps_per_m: Some(2000), rotation_steps: Some(4000), joint_steps: None };
        let expected = Precision { point: 2000, rotation: 4000, scalar: 800, ..Precision::default() };
        assert_eq!(config.precision.of_arena(own), expected);
        let expected = Precision { point: 700, scalar: 800, ..Precision::default() };
        assert_eq!(config.precision.of_arena(PrecisionFile::default()), expected);
    }

    #[test]
    fn refusals_name_file_key_value_and_allowed_range() {
        for (text, words) in [
            ("[tick]\ntick_hz = 29", &["my.toml", "tick.tick_hz", "29", "30 or 25"][..]),
            ("[tick]\nwhen_behind = 'panic'", &["tick.when_behind", "panic", "slow-down", "skip"]),
            ("[sessions]\nplayers_max = 0", &["my.toml", "sessions.players_max", "0", "1 to 1024"]),
            ("[sessions]\nplayers_max = 99999999999", &["sessions.players_max", "99999999999", "1 to 1024"]),
            ("[sessions]\nplayers_max = -1", &["sessions.players_max", "-1", "1 to 1024"]),
            ("[sessions]\nplayers_max = 'many'", &["sessions.players_max", "many", "1 to 1024"]),
            ("[sessions]\nplayers_max = 1.5", &["sessions.players_max", "1.5", "1 to 1024"]),
            ("[sessions]\nplayers = 3", &["my.toml", "sessions", "players", "unknown"]),
            ("[session]\nplayers_max = 3", &["my.toml", "session", "unknown"]),
            ("tick = 3", &["my.toml", "tick", "3"]),
            ("[network]\nlisten = 'localhost'", &["network.listen", "localhost", "tcp/"]),
            ("[network]\ndatagrams = 'tcp/127.0.0.1:1'", &["my.toml", "network.datagrams", "tcp/127.0.0.1:1", "udp/"]),
            ("[cells]\nkeyframe_ticks = 6", &["cells.keyframe_ticks", "6", "1, 2, 4, 8, 16 or 32"]),
            ("[tick]\ntick_hz =", &["my.toml", "line 2"]),
        ] {
            let said = refusal(text);
            for word in words {
                assert!(said.contains(word), "{text:?} is answered by {said:?}, which lacks {word:?}");
            }
        }
    }
}
