//! Parameters of an arena: whole numbers that who runs the arena may choose, `[parameters.NAME]`, and that its values
//! refer to, `"$NAME"`.

use std::collections::BTreeMap;

use serde::Deserialize;

use super::{ArenaError, FILE_MAX, Key, checks, syntax_error};

/// Most parameters of an arena.
const PARAMETERS_MAX: usize = 64;

/// A parameter.
#[derive(Clone, Copy, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ParameterFile {
    /// What it is where nobody chooses.
    pub default: i64,
    /// Least that it may be.
    pub min: i64,
    /// Most that it may be.
    pub max: i64,
}

/// The one table of a file that is read before the others.
#[derive(Deserialize)]
struct Head {
    #[serde(default)]
    parameters: BTreeMap<String, ParameterFile>,
}

/// The text of an arena with a number in place of every `"$NAME"`: what `given` says, else the default.
///
/// # Errors
/// [`ArenaError`] for text that is no TOML, a name that is none, or a number out of its range.
pub fn with_parameters(text: &str, given: &BTreeMap<String, i64>) -> Result<String, ArenaError> {
    Key::new("length of the file").count(text.len(), 1, FILE_MAX, "bytes")?;
    let Head { parameters } = toml::from_str(text).map_err(|e| syntax_error(text, &e))?;
    let key = Key::new("parameters");
    key.count(parameters.len(), 0, PARAMETERS_MAX, "parameters")?;
    for name in given.keys() {
        let allowed = checks::one_of("parameters", parameters.keys());
        key.require(parameters.contains_key(name), name, &allowed)?;
    }
    let mut text = text.to_owned();
    for (name, ParameterFile { default, min, max }) in &parameters {
        let value = given.get(name).unwrap_or(default);
        key.at(name).require((min..=max).contains(&value), value, &format!("{min} to {max}"))?;
        text = text.replace(&format!("\"${name}\""), &value.to_string());
    }
    Ok(text)
}
