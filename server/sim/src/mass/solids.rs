//! Mass properties of shapes in closed form.

use std::f64::consts::PI;

use glam::{DMat3, DVec3};

use super::integrals::{Integrals, VolumeMoments};
use super::polyhedron::Polyhedron;
use super::{Density, MassProperties, rounding};
use crate::collide::Shape;
use crate::error::SimError;

const NO_MASS: &str = "a half-space has no mass, nor has a surface";

impl Shape {
    /// Mass, centre and second moments of the solid, rounded edges and extrusion included.
    ///
    /// The principal axes of a hull need not be its own: see [`MassProperties::principal`].
    ///
    /// # Errors
    /// [`SimError`] naming the size that is out of range, a density that is not above 0 everywhere in the shape, a flat
    /// hull, or a half-space or a mesh, which have no mass.
    pub fn mass_properties(&self, density: Density) -> Result<MassProperties, SimError> {
        self.validate()?;
        if let Self::HalfSpace { .. } | Self::Mesh(_) = self {
            return Err(SimError::Unusable { what: NO_MASS });
        }
        density.require_positive(-self.reach(-density.direction()))?;
        self.integrate(density)
    }

    /// Moments of inertia about the body's axes through the centre of mass, of the homogeneous solid of `mass` kg,
    /// kg m².
    ///
    /// A half-space and a mesh have none, nor has a hull that is none: zero. The axes of a hull need not be principal: those of
    /// [`Shape::mass_properties`] are.
    pub fn inertia(&self, mass: f64) -> DVec3 {
        self.integrate(Density::constant(1.0)).map_or(DVec3::ZERO, |unit| {
            let tensor = unit.inertia() * (mass / unit.mass);
            DVec3::new(tensor.x_axis.x, tensor.y_axis.y, tensor.z_axis.z)
        })
    }

    fn integrate(&self, density: Density) -> Result<MassProperties, SimError> {
        let (volume, squares) = match *self {
            Self::HalfSpace { .. } | Self::Mesh(_) => return Err(SimError::Unusable { what: NO_MASS }),
            Self::Hull { ref points, radius } => return hull(points, radius, density),
            Self::Ball { radius } => ball(radius),
            Self::Box { half } => block(half),
            Self::Capsule { half_length, radius } => capsule(half_length, radius),
            Self::Cylinder { half_length, radius, rounding } => cylinder(half_length, radius, rounding),
        };
        // These mirror themselves in the origin: odd moments vanish.
        let (first, second) = (DVec3::ZERO, DMat3::from_diagonal(squares));
        let moments = VolumeMoments { volume, first, second, third: DMat3::ZERO };
        let integrals = moments.weighed(density.at_origin, density.gradient);
        MassProperties::from_integrals(DVec3::ZERO, integrals)
    }

    /// How far the shape reaches from the origin along a unit direction, m.
    fn reach(&self, d: DVec3) -> f64 {
        match *self {
            Self::HalfSpace { .. } | Self::Mesh(_) => f64::INFINITY,
            Self::Ball { radius } => radius,
            Self::Box { half } => half.dot(d.abs()),
            Self::Capsule { half_length, radius } => half_length * d.x.abs() + radius,
            Self::Cylinder { half_length, radius, rounding } => {
                (half_length - rounding) * d.z.abs() + (radius - rounding) * d.x.hypot(d.y) + rounding
            }
            Self::Hull { ref points, radius } => {
                points.iter().map(|p| p.dot(d)).fold(f64::NEG_INFINITY, f64::max) + radius
            }
        }
    }
}

fn hull(points: &[DVec3], radius: f64, density: Density) -> Result<MassProperties, SimError> {
    let hull = Polyhedron::of_hull(points)?;
    let core = hull.integrals(density);
    let shell = if radius > 0.0 { rounding::shell(&hull, radius, density)? } else { Integrals::ZERO };
    MassProperties::from_integrals(hull.middle(), core + shell)
}

/// Volume, m³, and ∫x², ∫y², ∫z², m⁵.
type Moments = (f64, DVec3);

fn block(half: DVec3) -> Moments {
    let volume = 8.0 * half.x * half.y * half.z;
    (volume, half * half * (volume / 3.0))
}

fn ball(r: f64) -> Moments {
    let volume = 4.0 / 3.0 * PI * r.powi(3);
    (volume, DVec3::splat(volume * r * r / 5.0))
}

/// Along x: a cylinder and two half balls, whose centres lie 3/8 r from their flat sides.
fn capsule(h: f64, r: f64) -> Moments {
    let (ball, ball_squares) = ball(r);
    let rod = 2.0 * PI * r * r * h;
    let along = rod * h * h / 3.0 + ball_squares.x + ball * (h * h + 0.75 * h * r);
    let across = rod * r * r / 4.0 + ball_squares.y;
    (rod + ball, DVec3::new(along, across, across))
}

/// Along z, edges rounded by c: discs of radius w(z) = a + √(c² − ζ²), ζ the height above the unrounded part, a the
/// radius within the rounding. The integrals of ζⁿ √(c² − ζ²)ᵐ from 0 to c are tabulated.
fn cylinder(half_length: f64, radius: f64, c: f64) -> Moments {
    let (h, a) = (half_length - c, radius - c);
    // ∫w², ∫ζ w², ∫ζ² w² and ∫w⁴ over one rounding.
    let w2 = a * a * c + a * PI * c * c / 2.0 + 2.0 / 3.0 * c.powi(3);
    let z_w2 = a * a * c * c / 2.0 + 2.0 / 3.0 * a * c.powi(3) + c.powi(4) / 4.0;
    let zz_w2 = a * a * c.powi(3) / 3.0 + a * PI * c.powi(4) / 8.0 + 2.0 / 15.0 * c.powi(5);
    let w4 = a.powi(4) * c
        + PI * a.powi(3) * c * c
        + 4.0 * a * a * c.powi(3)
        + 0.75 * PI * a * c.powi(4)
        + 8.0 / 15.0 * c.powi(5);
    let volume = 2.0 * PI * (h * radius * radius + w2);
    let along = 2.0 * PI * (h.powi(3) / 3.0 * radius * radius + h * h * w2 + 2.0 * h * z_w2 + zz_w2);
    let across = PI / 2.0 * (h * radius.powi(4) + w4);
    (volume, DVec3::new(across, across, along))
}
