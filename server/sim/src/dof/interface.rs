//! The DOF interface (talk, "The DOF Interface"): Kinematics, Inertia and Potentials are all the code that a kind needs.
//!
//! Particles and rigid bodies are built into the integrator, which predicts their free flight. Every other kind, one of a
//! game's own included, is a [`Dof`]: `examples/own_kind` makes one.
//!
//! Rates come in blocks of at most [`BLOCK_RATES_MAX`], the blocks of the sparse system.

use glam::{DMat3, DVec3};

use super::{Frame, Mount};
use crate::error::SimError;

/// Most rates of a block.
pub const BLOCK_RATES_MAX: usize = 6;

/// Derivative of a frame's twist (velocity, angular velocity) with respect to each rate of a block.
pub type Columns = [[f64; 6]; BLOCK_RATES_MAX];

/// A matrix between the rates of two blocks; rows and columns beyond their sizes are zero.
pub type RateBlock = [[f64; BLOCK_RATES_MAX]; BLOCK_RATES_MAX];

/// Sizes of a block of coordinates: a unit quaternion has four positions and three rates.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct BlockSize {
    /// Numbers in Q.
    pub positions: u8,
    /// Numbers in Q', 1 to [`BLOCK_RATES_MAX`].
    pub rates: u8,
}

/// A material point of a body.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PartPoint {
    /// Which of the body's parts.
    pub part: u32,
    /// In the part's frame, m.
    pub point: DVec3,
}

/// What pulls at a material point.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PartLoad {
    /// Where.
    pub at: PartPoint,
    /// Minus the impulse of the tick, N s.
    pub impulse: DVec3,
}

/// Inertia of a kind: the relation between forces and accelerations.
#[derive(Clone, Copy, Debug)]
pub enum Inertia<'a> {
    /// Rigid parts, one for every part: their momentum is differenced in world space and projected on the rates.
    Parts(&'a [PartInertia]),
    /// Every block is a point of the world (its three rates are the point's velocity) and the mass matrix is constant.
    Points(&'a PointMasses),
}

/// Inertia of one rigid part.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PartInertia {
    /// kg.
    pub mass: f64,
    /// Centre of mass in the part's frame, m.
    pub centre: DVec3,
    /// About the centre of mass, in the part's frame, kg m².
    pub inertia: DMat3,
}

/// A constant mass matrix over points: one number for each pair, times the 3×3 identity.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct PointMasses {
    /// m_ii, kg.
    pub diagonal: Vec<f64>,
    /// (i, j, m_ij) with i > j, kg.
    pub off_diagonal: Vec<(u32, u32, f64)>,
}

/// A distance between two points of a body that is to be held (talk, "Constraints").
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PointRod {
    /// Blocks of the two points.
    pub points: [u32; 2],
    /// m.
    pub length: f64,
    /// How far it may be off at the end of a tick, m.
    pub tolerance: f64,
}

/// A body's state within a tick: positions and rates at its start, and at a candidate for its end.
#[derive(Clone, Copy, Debug)]
pub struct LocalState<'a> {
    /// Length of the tick, s.
    pub dt: f64,
    /// Positions at the start.
    pub q0: &'a [f64],
    /// Rates at the start.
    pub v0: &'a [f64],
    /// Positions at the candidate.
    pub q1: &'a [f64],
    /// Rates at the candidate.
    pub v1: &'a [f64],
    /// What steers it from outside: [`Dof::controls`], or what was set since.
    pub controls: &'a [f64],
    /// What [`Dof::prepare`] found for this tick.
    pub prepared: &'a [f64],
    /// Whether second derivatives have to be positive semidefinite: the sum over everything turned out not to be.
    pub definite: bool,
}

/// A kind of DOF with everything about one body of that kind that does not change.
pub trait Dof: Send + Sync {
    /// What people call the kind.
    fn kind(&self) -> super::DofKind;

    /// What is wrong with a state, beyond numbers that are not finite or too many.
    ///
    /// # Errors
    /// [`SimError`] naming the item.
    fn check(&self, _q: &[f64], _v: &[f64]) -> Result<(), SimError> {
        Ok(())
    }

    // --- Kinematics

    /// Its blocks of coordinates. Q and Q' hold them one after the other.
    fn blocks(&self) -> &[BlockSize];

    /// Q1 = Q0 ⊕ dt Q1': the talk's second axiom. What is no vector space, a rotation, steps by its exponential map.
    fn step(&self, q0: &[f64], v1: &[f64], dt: f64, q1: &mut [f64]) {
        for ((q1, q0), v1) in q1.iter_mut().zip(q0).zip(v1) {
            *q1 = q0 + dt * v1;
        }
    }

    /// Number of parts.
    fn parts(&self) -> u32;

    /// The frame at a material point, with the rotation of the part there.
    fn frame(&self, at: PartPoint, q: &[f64], v: &[f64]) -> Frame<f64>;

    /// Place, m, and velocity, m/s, of a material point, for kinds to which that is less work than its frame.
    fn point(&self, at: PartPoint, q: &[f64], v: &[f64]) -> [DVec3; 2] {
        let frame = self.frame(at, q, v);
        [frame.position.into(), frame.linear.into()]
    }

    /// Hands `visit` every block that moves the frame at a material point, with the frame's derivatives.
    fn jacobian(&self, at: PartPoint, q: &[f64], visit: &mut dyn FnMut(usize, &Columns));

    /// Both at once, for kinds to which that is less work.
    fn frame_and_jacobian(
        &self,
        at: PartPoint,
        q: &[f64],
        v: &[f64],
        visit: &mut dyn FnMut(usize, &Columns),
    ) -> Frame<f64> {
        self.jacobian(at, q, visit);
        self.frame(at, q, v)
    }

    /// Whether the place of a material point, apart from its axes, is linear in Q: [`Dof::place_jacobian`] is then the same
    /// in every state. Springs, rods, ball joints and controllers at such points are cheap.
    fn is_linear(&self, _at: PartPoint) -> bool {
        false
    }

    /// As [`Dof::jacobian`], for a material point whose axes nobody asks for: what turns them may be left out.
    fn place_jacobian(&self, at: PartPoint, q: &[f64], visit: &mut dyn FnMut(usize, &Columns)) {
        self.jacobian(at, q, visit);
    }

    /// How the frame at a material point follows from Q, for whoever shows the body and does not know its kind. `None`
    /// where that cannot be said: the body is shown by what its game makes of Q.
    fn mount(&self, _at: PartPoint) -> Option<Mount> {
        None
    }

    // --- Inertia

    /// Its inertia.
    fn inertia(&self) -> Inertia<'_>;

    /// For [`Inertia::Parts`]: hands `add` the positive semidefinite part of the second derivative of Σ impulse · x over
    /// `loads`, with respect to turns of parts, N m s. The impulses are what the figure's own rigidity hands on; without
    /// this Newton fails where light parts carry heavy ones. The first loads are the parts' centres of mass, one a part,
    /// with the parts' rotations in `centres`; all may be overwritten.
    fn geometric_stiffness(
        &self,
        _q1: &[f64],
        _centres: &[Frame<f64>],
        _loads: &mut [PartLoad],
        _add: &mut dyn FnMut(usize, DMat3),
    ) {
    }

    // --- Potentials

    /// Rods between its points; for [`Inertia::Points`] alone.
    fn rods(&self) -> &[PointRod] {
        &[]
    }

    /// Numbers that steer it from outside, such as the targets of motors, as they are at first.
    fn controls(&self) -> Vec<f64> {
        Vec::new()
    }

    /// What is wrong with such numbers in a world of ticks of `dt` seconds. They are no NaN and as many as at first.
    ///
    /// # Errors
    /// [`SimError`] naming the item.
    fn check_controls(&self, _controls: &[f64], _dt: f64) -> Result<(), SimError> {
        Ok(())
    }

    /// Appends to `prepared` what its potentials need all through a tick. The candidate is still the start.
    fn prepare(&self, _at: &LocalState, _prepared: &mut Vec<f64>) {}

    /// Energy of its own potentials at the candidate, J, damping and motors included. Adds the derivative with respect to each rate's displacement
    /// (rate × dt) to `gradient`.
    fn energy(&self, _at: &LocalState, _gradient: &mut [f64]) -> f64 {
        0.0
    }

    /// Energy that its own potentials hold at the candidate and could give back, J.
    fn stored_energy(&self, at: &LocalState) -> f64 {
        self.energy(at, &mut vec![0.0; at.v1.len()])
    }

    /// Hands `add` the second derivative of [`Dof::energy`]: (row block, column block, entries) for the diagonal and the
    /// pairs with row > column. It is positive semidefinite where that is asked for ([`LocalState::definite`]); else the
    /// derivative as it is serves Newton better where the sum with inertia and neighbours is definite all the same.
    ///
    /// Kinds with [`Inertia::Points`] answer [`Dof::point_stiffness`] instead.
    fn stiffness(&self, _at: &LocalState, _add: &mut dyn FnMut(usize, usize, &RateBlock)) {}

    /// Hands `couple` every pair of different blocks that [`Dof::stiffness`] may answer, the same pairs at all times.
    fn couplings(&self, _couple: &mut dyn FnMut(usize, usize)) {}

    /// The second derivative as of [`Dof::stiffness`], for [`Inertia::Points`] alone, N/m: adds the blocks of each point
    /// with itself to `own`, those of each pair in [`PointMasses::off_diagonal`] to `pairs`. What a pair without common
    /// mass is coupled by needs an entry of zero there.
    fn point_stiffness(&self, _at: &LocalState, _own: &mut [DMat3], _pairs: &mut [DMat3]) {}
}

impl PointMasses {
    /// Mass matrix of `points` points without mass.
    pub fn new(points: usize) -> Self {
        Self { diagonal: vec![0.0; points], off_diagonal: Vec::new() }
    }

    /// Adds the mass matrix `m` over `points`, kg.
    pub fn add<const N: usize>(&mut self, points: [u32; N], m: &[[f64; N]; N]) {
        for (i, &p) in points.iter().enumerate() {
            for (j, &q) in points.iter().enumerate() {
                self.add_entry(p, q, m[i][j]);
            }
        }
    }

    /// Adds `m`, kg, between points `p` and `q`, where it is in the half that is stored.
    pub(crate) fn add_entry(&mut self, p: u32, q: u32, m: f64) {
        if p == q {
            self.diagonal[p as usize] += m;
        } else if q < p {
            match self.off_diagonal.binary_search_by_key(&(p, q), |&(p, q, _)| (p, q)) {
                Ok(place) => self.off_diagonal[place].2 += m,
                Err(place) => self.off_diagonal.insert(place, (p, q, m)),
            }
        }
    }

    /// Mass that a uniform acceleration of every point feels at each: the row sums, kg.
    pub fn lumped(&self) -> Vec<f64> {
        let mut lumped = self.diagonal.clone();
        for &(i, j, m) in &self.off_diagonal {
            lumped[i as usize] += m;
            lumped[j as usize] += m;
        }
        lumped
    }

    /// Of all points, kg.
    pub fn total(&self) -> f64 {
        self.diagonal.iter().sum::<f64>() + 2.0 * self.off_diagonal.iter().map(|&(.., m)| m).sum::<f64>()
    }
}
