//! A game's own DOF kind: a particle in the x-y plane whose coordinates are r and θ.
//!
//! The coordinates are curved, and that is the point: the equations of motion in r and θ have centrifugal and Coriolis
//! terms, but nobody writes them. The kind says where its point is and how the rates move it; the engine differences
//! momentum in world space and projects the difference on the rates. (Differencing r' and r²θ' themselves, the talk's
//! formula taken at its word, would never let the particle move outwards.)

use std::sync::Arc;

use pita_sim::dof::{BlockSize, Columns, Inertia, PartInertia};
use pita_sim::{DMat3, DVec3, Dof, DofKind, FigureDesc, Frame, PartPoint, SimError};

/// A particle at (r cos θ, r sin θ, 0).
pub struct PolarParticle {
    inertia: [PartInertia; 1],
}

impl PolarParticle {
    /// Of `mass` kg at radius `r`, m, and angle `theta`, rad, with rates in m/s and rad/s.
    pub fn describe(mass: f64, [r, theta]: [f64; 2], rates: [f64; 2]) -> FigureDesc {
        // It is a point: it never turns, so what would resist a turn is zero.
        let inertia = [PartInertia { mass, centre: DVec3::ZERO, inertia: DMat3::ZERO }];
        FigureDesc { dof: Arc::new(Self { inertia }), q: vec![r, theta], v: rates.to_vec(), colliders: Vec::new() }
    }
}

impl Dof for PolarParticle {
    fn kind(&self) -> DofKind {
        DofKind::Own("polar particle")
    }

    /// One block of two coordinates. They step as they are: [`Dof::step`] need not be written.
    fn blocks(&self) -> &[BlockSize] {
        &[BlockSize { positions: 2, rates: 2 }]
    }

    fn check(&self, q: &[f64], _v: &[f64]) -> Result<(), SimError> {
        let outside = q[0] > 0.0;
        if outside { Ok(()) } else { Err(SimError::Unusable { what: "at r = 0 a polar particle has no angle" }) }
    }

    fn parts(&self) -> u32 {
        1
    }

    /// A point has no axes to turn: whatever point of it is asked for, it is the particle.
    fn frame(&self, _at: PartPoint, q: &[f64], v: &[f64]) -> Frame<f64> {
        let [outwards, onwards] = directions(q);
        Frame::point(q[0] * outwards, v[0] * outwards + v[1] * q[0] * onwards)
    }

    fn jacobian(&self, _at: PartPoint, q: &[f64], visit: &mut dyn FnMut(usize, &Columns)) {
        let [outwards, onwards] = directions(q);
        let mut columns = Columns::default();
        columns[0][..3].copy_from_slice(&outwards.to_array());
        columns[1][..3].copy_from_slice(&(q[0] * onwards).to_array());
        visit(0, &columns);
    }

    fn inertia(&self) -> Inertia<'_> {
        Inertia::Parts(&self.inertia)
    }
}

/// Unit vectors along growing r and growing θ.
fn directions(q: &[f64]) -> [DVec3; 2] {
    let (sin, cos) = q[1].sin_cos();
    [DVec3::new(cos, sin, 0.0), DVec3::new(-sin, cos, 0.0)]
}
