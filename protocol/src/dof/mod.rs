//! DOF streams: Q as integers, predicted along Q', entropy-coded, safe under loss.
//!
//! ```text
//!  State ── quantise ──▶ steps ──┐
//!                                ├─ walk ── residual ── model ── ans ──▶ bytes
//!  Frame (baseline) ── predict ──┘             the same walk reads ◀─────────────┘
//! ```
//!
//! Owns quantisation ([`State`], [`Precision`]), prediction, the adaptive models and both ends of a stream ([`Encoder`],
//! [`Decoder`]). It may touch nothing but bytes: no I/O, no clock, no engine. What both sides compute is integer
//! arithmetic in one function for both directions, so they cannot disagree; floating point stays outside, in
//! quantisation and in what a [`Frame`] is turned into for its user. `protocol/PROTOCOL.md` specifies all of it.
//!
//! Kinds of bodies, by [`Body::kind`], are the [`kind`]s below. Whatever the kind, a body is a row of [`Group`]s.

mod ans;
mod budget;
mod cells;
mod frame;
#[cfg(test)]
mod golden;
mod hinge;
mod model;
mod predict;
mod priority;
mod quantise;
mod quaternion;
mod residual;
mod slice;
mod stream;
#[cfg(test)]
mod tests;
mod walk;

pub use budget::{Budget, Cost, Need, Spent};
pub use cells::{Cadence, CellDecoder, CellEncoder, Coded, Due};
pub use frame::{BODIES_MAX, BODY_GROUPS_MAX, Body, Frame, GROUPS_MAX, State};
pub use predict::GroupState;
pub use priority::{Priorities, Relevance};
pub use quantise::{Group, Precision, Quantised, STEPS_MAX, absolute, relative, rotate};
pub use slice::Slice;
pub use stream::{Decoder, Encoder, HISTORY, base_of};

/// What the numbers of a body mean.
pub mod kind {
    /// A point.
    pub const PARTICLE: u8 = 0;
    /// Centre of mass and rotation.
    pub const RIGID_BODY: u8 = 1;
    /// Joint coordinates: points, rotations and scalars as the figure's joints are.
    pub const ARTICULATED: u8 = 2;
    /// Points in space that carry rigid parts.
    pub const NATURAL: u8 = 3;
    /// Nodes of a mesh.
    pub const FINITE_ELEMENTS: u8 = 4;
    /// Nodes of a lattice.
    pub const LATTICE: u8 = 5;
    /// A game's own.
    pub const OWN: u8 = 255;
}
