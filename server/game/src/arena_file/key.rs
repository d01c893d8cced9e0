//! Places in an arena file, and the checks of the numbers there.

use std::fmt;

use super::ArenaError;

/// Path of a key in a file: `statics[3].position[0]`.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Key(String);

impl fmt::Display for Key {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.0)
    }
}

impl Key {
    /// A key at the top of the file.
    pub fn new(name: &str) -> Self {
        Self(name.to_owned())
    }

    /// The key `name` below this one.
    pub fn at(&self, name: &str) -> Self {
        Self(format!("{}.{name}", self.0))
    }

    /// Element `index` of the list that is here.
    pub fn index(&self, index: usize) -> Self {
        Self(format!("{}[{index}]", self.0))
    }

    /// # Errors
    /// [`ArenaError::OutOfRange`] unless `value` is a number from `min` to `max`.
    pub fn number(&self, value: f64, min: f64, max: f64, unit: &str) -> Result<(), ArenaError> {
        let allowed = format!("{min} to {max} {unit}");
        self.require((min..=max).contains(&value), value, allowed.trim_end())
    }

    /// # Errors
    /// [`ArenaError::OutOfRange`] unless `value` is from `min` to `max`.
    pub fn count(&self, value: usize, min: usize, max: usize, what: &str) -> Result<(), ArenaError> {
        let allowed = format!("{min} to {max} {what}");
        self.require((min..=max).contains(&value), value, allowed.trim_end())
    }

    /// # Errors
    /// [`ArenaError::OutOfRange`] unless each of `point` is within ±`bound`, in m.
    pub fn vector(&self, point: [f64; 3], bound: f64) -> Result<(), ArenaError> {
        point.iter().enumerate().try_for_each(|(i, &x)| self.index(i).number(x, -bound, bound, "m"))
    }

    /// # Errors
    /// [`ArenaError::OutOfRange`] unless `ok`.
    pub fn require(&self, ok: bool, value: impl fmt::Display, allowed: &str) -> Result<(), ArenaError> {
        if ok { Ok(()) } else { Err(self.refuse(value, allowed)) }
    }

    /// The error that what is here is none of what is allowed.
    pub fn refuse(&self, value: impl fmt::Display, allowed: &str) -> ArenaError {
        ArenaError::OutOfRange { key: self.to_string(), value: value.to_string(), allowed: allowed.to_owned() }
    }
}
