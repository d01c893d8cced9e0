//! Conditions as text on a command line.

use std::{str::FromStr, time::Duration};

use super::{ConditionerSettings, Conditions, Freeze};

/// Why a text says no conditions.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum ConditionsError {
    /// Not `key=value`.
    #[error("`{0}`: write key=value pairs with commas between, for example latency=50,jitter=20,loss=5")]
    NoPair(String),
    /// No such key.
    #[error(
        "`{0}`: keys are latency, jitter, loss, duplicate, reorder, rate, freeze and seed, all but the last with `up.` or \
         `down.` before for one direction"
    )]
    NoKey(String),
    /// The value is none for its key.
    #[error("`{key}={value}`: allowed is {allowed}")]
    Value {
        /// The key.
        key: String,
        /// What it is set to.
        value: String,
        /// What may be there.
        allowed: &'static str,
    },
}

impl FromStr for ConditionerSettings {
    type Err = ConditionsError;

    fn from_str(text: &str) -> Result<Self, ConditionsError> {
        let mut settings = Self::default();
        for pair in text.split(',').map(str::trim).filter(|pair| !pair.is_empty()) {
            let (key, value) = pair.split_once('=').ok_or_else(|| ConditionsError::NoPair(pair.to_owned()))?;
            let (key, value) = (key.trim(), value.trim());
            match key.split_once('.') {
                None if key == "seed" => {
                    settings.seed = value.parse().map_err(|_| refused(key, value, "a whole number"))?;
                }
                None => {
                    settings.up.set(key, key, value)?;
                    settings.down.set(key, key, value)?;
                }
                Some(("up", of_up)) => settings.up.set(key, of_up, value)?,
                Some(("down", of_down)) => settings.down.set(key, of_down, value)?,
                Some(_) => return Err(ConditionsError::NoKey(key.to_owned())),
            }
        }
        Ok(settings)
    }
}

impl Conditions {
    /// Sets what `name` means to `value`; `key` is what it was written as.
    fn set(&mut self, key: &str, name: &str, value: &str) -> Result<(), ConditionsError> {
        let time = |allowed| number(value, 0.0, 10_000.0).map(|ms| Duration::from_secs_f64(ms * 1e-3)).ok_or(allowed);
        let share = |allowed| number(value, 0.0, 100.0).map(|percent| percent * 0.01).ok_or(allowed);
        let done = match name {
            "latency" => time("0 to 10000 ms").map(|latency| self.latency = latency),
            "jitter" => time("0 to 10000 ms").map(|jitter| self.jitter = jitter),
            "loss" => share("0 to 100 per cent").map(|loss| self.loss = loss),
            "duplicate" => share("0 to 100 per cent").map(|duplicate| self.duplicate = duplicate),
            "reorder" => share("0 to 100 per cent").map(|reorder| self.reorder = reorder),
            "rate" => {
                let rate = value.parse().ok().filter(|rate| *rate > 0);
                rate.map(|rate| self.rate = Some(rate)).ok_or("1 B/s or more")
            }
            "freeze" => {
                let allowed = "EVERY/FOR in s, FOR shorter than EVERY, EVERY at most 3600";
                freeze(value).map(|freeze| self.freeze = Some(freeze)).ok_or(allowed)
            }
            _ => return Err(ConditionsError::NoKey(key.to_owned())),
        };
        done.map_err(|allowed| refused(key, value, allowed))
    }
}

fn freeze(value: &str) -> Option<Freeze> {
    let (every, lasting) = value.split_once('/')?;
    let (every, lasting) = (number(every, 0.01, 3600.0)?, number(lasting, 0.0, 3600.0)?);
    let seconds = Duration::from_secs_f64;
    (lasting < every).then(|| Freeze { every: seconds(every), lasting: seconds(lasting) })
}

fn number(text: &str, least: f64, most: f64) -> Option<f64> {
    text.parse().ok().filter(|x| (least..=most).contains(x))
}

fn refused(key: &str, value: &str, allowed: &'static str) -> ConditionsError {
    ConditionsError::Value { key: key.to_owned(), value: value.to_owned(), allowed }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn pairs_are_for_both_directions_or_one() {
        let text = "latency=50, jitter=20,loss=5,up.loss=1.5,down.rate=8000,down.freeze=10/0.5,seed=7";
        let settings: ConditionerSettings = text.parse().unwrap();
        assert_eq!((settings.up.latency, settings.down.jitter), (Duration::from_millis(50), Duration::from_millis(20)));
        assert_eq!((settings.up.loss, settings.down.loss, settings.seed), (0.015, 0.05, 7));
        assert_eq!((settings.up.rate, settings.down.rate), (None, Some(8000)));
        assert_eq!(settings.down.freeze.unwrap().lasting, Duration::from_millis(500));
        assert_eq!("".parse(), Ok(ConditionerSettings::default()));
    }

    #[test]
    fn refusals_say_what_is_allowed() {
        for (text, word) in [
            ("latency", "key=value"),
            ("lag=3", "latency, jitter"),
            ("left.loss=3", "`up.`"),
            ("loss=101", "0 to 100"),
            ("loss=NaN", "0 to 100"),
            ("up.latency=-1", "`up.latency=-1`"),
            ("rate=0", "1 B/s"),
            ("freeze=1/2", "EVERY/FOR"),
            ("seed=x", "whole number"),
        ] {
            let said = text.parse::<ConditionerSettings>().unwrap_err().to_string();
            assert!(said.contains(word), "{text}: {said}");
        }
    }
}
