//! What the engine refuses, and why.

/// A call that the engine refuses. Nothing was changed.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum SimError {
    /// A number out of its range, or not finite.
    #[error("{what} is {value}, allowed is {allowed}")]
    OutOfRange {
        /// Which number.
        what: &'static str,
        /// What it was.
        value: f64,
        /// What it may be.
        allowed: &'static str,
    },
    /// A handle whose body, static or potential is gone.
    #[error("{what} does not exist (any more)")]
    Gone {
        /// What the handle was for.
        what: &'static str,
    },
    /// A name that is not in the list.
    #[error("{what} {name:?} is unknown, known are {known}")]
    UnknownName {
        /// What was named.
        what: &'static str,
        /// As it was given, its first 64 characters.
        name: String,
        /// The list.
        known: String,
    },
    /// Something that makes no sense between these bodies.
    #[error("{what}")]
    Unusable {
        /// Why not.
        what: &'static str,
    },
    /// One of several items is refused.
    #[error("{item}: {reason}")]
    Named {
        /// Which one, such as `part 2 (head)`.
        item: String,
        /// Why.
        reason: Box<SimError>,
    },
}

impl SimError {
    /// The same, said of `item`.
    pub fn of(self, item: impl Into<String>) -> Self {
        Self::Named { item: item.into(), reason: Box::new(self) }
    }
}

/// `Err` unless `value` is finite and `ok`.
pub(crate) fn require(ok: bool, what: &'static str, value: f64, allowed: &'static str) -> Result<(), SimError> {
    if ok && value.is_finite() { Ok(()) } else { Err(SimError::OutOfRange { what, value, allowed }) }
}

/// Bound of every coordinate, speed and force: squares and products of such numbers stay finite.
pub(crate) const LARGEST: f64 = 1e9;

/// `Err` unless all numbers are finite and smaller than [`LARGEST`].
pub(crate) fn require_vector(vector: glam::DVec3, what: &'static str) -> Result<(), SimError> {
    let largest = vector.abs().max_element();
    let value = if vector.is_finite() { largest } else { f64::NAN };
    require(largest < LARGEST, what, value, "finite and below 1e9")
}

/// `Err` unless the vector is finite and has a direction.
pub(crate) fn require_direction(vector: glam::DVec3, what: &'static str) -> Result<(), SimError> {
    require_vector(vector, what)?;
    let length = vector.length();
    require(length > 1e-6, what, length, "a vector longer than 1e-6")
}

/// `Err` unless the quaternion is finite and of unit length within 1e-3.
pub(crate) fn require_rotation(rotation: glam::DQuat, what: &'static str) -> Result<(), SimError> {
    let length = rotation.length();
    require((length - 1.0).abs() < 1e-3, what, length, "a quaternion of length 1")
}
