//! Material points of figures at which something acts: frames of an island beside those of its blocks.

use glam::DMat3;

use super::figure::Figure;
use crate::dof::{Columns, Frame, PartPoint, Twist};

/// How an attachment follows its figure to a candidate state.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Follows {
    /// As its derivatives at the start of the tick say: contacts.
    Start,
    /// As a place alone, and with it that is linear: its derivatives never change, and it has no axes.
    Place,
    /// As the figure says, axes and derivatives too.
    Figure,
}

/// A material point of a figure at which something acts: one more frame of the island.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Attachment {
    pub figure: u32,
    /// [`ABSENT`](crate::dof::ABSENT) is the part of a point between vertices.
    pub at: PartPoint,
    pub follows: Follows,
    pub influences: (u32, u32),
    pub start: Frame<f64>,
    /// What resists a force here, kg.
    pub mass: f64,
    /// What a torque turns here, mean over axes, 1/(kg m²).
    pub inverse_inertia: f64,
}

/// How a block moves an attachment's frame.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Influence {
    /// Index in the island.
    pub block: u32,
    /// Block's index in its figure.
    pub own_block: u32,
    /// Rates that the block has.
    pub size: u8,
    pub columns: Columns,
}

impl Attachment {
    /// The frame at the figure's candidate state; refreshes derivatives that change.
    pub fn frame(&self, figure: &Figure, influences: &mut [Influence]) -> Frame<f64> {
        match self.follows {
            Follows::Start => {
                let Twist { linear, angular } = figure.twist(influences, &figure.v1);
                Frame { linear: linear.into(), angular: angular.into(), ..self.start }
            }
            Follows::Place => {
                let [position, velocity] = figure.dof.point(self.at, &figure.q1, &figure.v1);
                Frame::point(position, velocity)
            }
            Follows::Figure => {
                let mut next = influences.iter_mut();
                figure.dof.frame_and_jacobian(self.at, &figure.q1, &figure.v1, &mut |_, columns| {
                    if let Some(influence) = next.next() {
                        influence.columns = *columns;
                    }
                })
            }
        }
    }
}

/// Sum of the diagonal.
pub(super) fn trace(m: DMat3) -> f64 {
    m.x_axis.x + m.y_axis.y + m.z_axis.z
}
