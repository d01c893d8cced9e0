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

/// The parameters of an arena's text.
fn read(text: &str) -> Result<BTreeMap<String, ParameterFile>, ArenaError> {
    Key::new("length of the file").count(text.len(), 1, FILE_MAX, "bytes")?;
    let Head { parameters } = toml::from_str(text).map_err(|e| syntax_error(text, &e))?;
    Key::new("parameters").count(parameters.len(), 0, PARAMETERS_MAX, "parameters")?;
    Ok(parameters)
}

/// What may be chosen at most: every parameter at its least and at its most while the others are at their defaults, and all
/// at their most together. Where an arena is good there, and as it is, one does not expect it to be bad in between.
///
/// # Errors
/// [`ArenaError`] for text that is no TOML.
pub fn extremes(text: &str) -> Result<Vec<BTreeMap<String, i64>>, ArenaError> {
    let parameters = read(text)?;
    let most = parameters.iter().map(|(name, parameter)| (name.clone(), parameter.max)).collect();
    let alone = parameters.iter().flat_map(|(name, &ParameterFile { default, min, max })| {
        let ends = [min, max].into_iter().filter(move |&end| end != default);
        ends.map(move |end| BTreeMap::from([(name.clone(), end)]))
    });
    let together = (parameters.len() > 1).then_some(most);
    Ok(alone.chain(together).collect())
}

/// The text of an arena with a number in place of every `"$NAME"`: what `given` says, else the default.
///
/// # Errors
/// [`ArenaError`] for text that is no TOML, a name that is none, or a number out of its range.
pub fn with_parameters(text: &str, given: &BTreeMap<String, i64>) -> Result<String, ArenaError> {
    let parameters = read(text)?;
    let key = Key::new("parameters");
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
