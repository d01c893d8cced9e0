//! Mass matrices of points in which a solid is embedded (talk, "Inertia": JᵀmJ, "scattering little bits of mass across
//! the sheep's DOF"). A place in the solid is Σ Nᵢ qᵢ of the points q, so m_ij = ∫ρ Nᵢ Nⱼ, once for x, y and z.
//!
//! Such a matrix is constant: the rates of the points weigh the same in whatever way they have moved.

use glam::{DMat4, DVec3, DVec4};

use super::integrals::{prism, volume};
use super::polyhedron::Polyhedron;
use super::{Density, MassProperties};
use crate::error::{SimError, require, require_vector};

/// Four points span a volume where it is more than this fraction of the cube of their longest edge.
const FLATTEST: f64 = 1e-9;

/// Mass matrix of a rigid part whose places are barycentric combinations of four points ("natural coordinates"), kg.
/// `points` and `props` are in one frame.
///
/// # Errors
/// [`SimError`] where a point is not finite or the four lie in a plane.
pub fn embedded_mass(points: &[DVec3; 4], props: &MassProperties) -> Result<[[f64; 4]; 4], SimError> {
    require_volume(points)?;
    let [a, b, c, d] = points.map(|p| (p - props.centre).extend(1.0));
    // λ(x) = weights · (x − centre, 1).
    let weights = DMat4::from_cols(a, b, c, d).inverse().transpose().to_cols_array_2d().map(DVec4::from_array);
    let entry =
        |one: DVec4, other: DVec4| props.mass * one.w * other.w + one.truncate().dot(props.moments * other.truncate());
    Ok(weights.map(|one| weights.map(|other| entry(one, other))))
}

/// Consistent mass matrix of a linear tetrahedron, kg: ρV/20 (1 + δij) where the density is constant.
///
/// # Errors
/// [`SimError`] where a corner is not finite, the corners lie in a plane, or the density is not above 0.
pub fn tetrahedron_mass(corners: &[DVec3; 4], density: Density) -> Result<[[f64; 4]; 4], SimError> {
    require_volume(corners)?;
    let along = corners.map(|p| p.dot(density.direction()));
    density.require_positive(along.into_iter().fold(f64::INFINITY, f64::min))?;
    let densities = corners.map(|p| density.at(p));
    let sum: f64 = densities.iter().sum();
    let unit = volume(*corners).abs() / 120.0;
    Ok(std::array::from_fn(|i| {
        std::array::from_fn(|j| {
            let twice = if i == j { 2.0 } else { 1.0 };
            unit * twice * (sum + densities[i] + densities[j])
        })
    }))
}

/// Mass matrix of the part of a solid inside the box from `min` to `max`, embedded in the box's corners by trilinear
/// interpolation, kg. Bit 0, 1, 2 of a corner's index says whether it is at the upper x, y, z.
///
/// Exact: the solid is clipped to the box and the polynomials integrated by Gauss quadrature of their degree.
///
/// # Errors
/// [`SimError`] where the box is empty or not finite, or the density is not above 0 in the solid.
pub fn lattice_cell_mass(
    min: DVec3,
    max: DVec3,
    solid: &Polyhedron,
    density: Density,
) -> Result<[[f64; 8]; 8], SimError> {
    require_vector(min, "corner of a lattice cell")?;
    require_vector(max, "corner of a lattice cell")?;
    let thinnest = (max - min).min_element();
    require(thinnest > 0.0, "size of a lattice cell", thinnest, "above 0 m")?;
    solid.require_positive(density)?;
    let mut mass = [[0.0; 8]; 8];
    let mut pieces = Vec::new();
    for corners in solid.tetrahedra() {
        clip_to_box(corners.map(|p| (p - min) / (max - min)), &mut pieces);
        for piece in &pieces {
            let density_at = |u: DVec3| density.at(min + u * (max - min));
            add_trilinear(*piece, (max - min).element_product(), density_at, &mut mass);
        }
    }
    Ok(mass)
}

fn require_volume(points: &[DVec3; 4]) -> Result<(), SimError> {
    points.iter().try_for_each(|&p| require_vector(p, "points"))?;
    let longest = points.iter().flat_map(|a| points.map(|b| (b - a).length())).fold(0.0, f64::max);
    let spans = volume(*points).abs() > FLATTEST * longest.powi(3);
    if spans { Ok(()) } else { Err(SimError::Unusable { what: "four points lie in a plane" }) }
}

/// Tetrahedra that make up the part of a tetrahedron inside the unit box, each signed as the whole.
fn clip_to_box(tetrahedron: [DVec3; 4], pieces: &mut Vec<[DVec3; 4]>) {
    pieces.clear();
    pieces.push(tetrahedron);
    for axis in [DVec3::X, DVec3::Y, DVec3::Z] {
        for (normal, offset) in [(axis, 0.0), (-axis, 1.0)] {
            let whole = std::mem::take(pieces);
            for corners in whole {
                clip(corners, corners.map(|p| normal.dot(p) + offset), pieces);
            }
        }
    }
}

/// Keeps the part of a tetrahedron where the height, given at its corners, is positive.
fn clip(corners: [DVec3; 4], heights: [f64; 4], kept: &mut Vec<[DVec3; 4]>) {
    let cut = |i: usize, j: usize| corners[i].lerp(corners[j], heights[i] / (heights[i] - heights[j]));
    let inside: [bool; 4] = heights.map(|h| h > 0.0);
    let first = kept.len();
    // `place` of what is alone, or of the two that are inside.
    let place = |wanted: bool, nth: usize| (0..4).filter(|&i| inside[i] == wanted).nth(nth).unwrap_or(0);
    match inside.iter().filter(|&&inside| inside).count() {
        0 => {}
        1 => {
            let a = place(true, 0);
            kept.push([0, 1, 2, 3].map(|i| if i == a { corners[a] } else { cut(a, i) }));
        }
        2 => {
            let (a, b, c, d) = (place(true, 0), place(true, 1), place(false, 0), place(false, 1));
            kept.extend(prism([corners[a], cut(a, c), cut(a, d)], [corners[b], cut(b, c), cut(b, d)]));
        }
        3 => {
            let (a, b, c, out) = (place(true, 0), place(true, 1), place(true, 2), place(false, 0));
            let low = [corners[a], corners[b], corners[c]];
            kept.extend(prism(low, [cut(a, out), cut(b, out), cut(c, out)]));
        }
        _ => kept.push(corners),
    }
    // Sorting the corners may have mirrored the pieces.
    let sign = volume(corners);
    for piece in &mut kept[first..] {
        if volume(*piece) * sign < 0.0 {
            piece.swap(0, 1);
        }
    }
}

/// Nodes and weights of Gauss-Legendre quadrature on [0, 1]: exact to degree 9.
const GAUSS: [(f64, f64); 5] = [
    (0.046_910_077_030_668_004, 0.118_463_442_528_094_54),
    (0.230_765_344_947_158_45, 0.239_314_335_249_683_23),
    (0.5, 0.284_444_444_444_444_44),
    (0.769_234_655_052_841_5, 0.239_314_335_249_683_23),
    (0.953_089_922_969_332, 0.118_463_442_528_094_54),
];

/// Adds ∫ρ Nᵢ Nⱼ over a tetrahedron inside the unit box, times `scale`.
///
/// ρ Nᵢ Nⱼ has degree 7; a cube collapsed to a tetrahedron multiplies by a square: degree 9.
fn add_trilinear(corners: [DVec3; 4], scale: f64, density: impl Fn(DVec3) -> f64, mass: &mut [[f64; 8]; 8]) {
    for_each_gauss_point(corners, |u, volume| {
        let weight = scale * volume * density(u);
        let shape = trilinear(u);
        for (row, one) in mass.iter_mut().zip(shape) {
            for (entry, other) in row.iter_mut().zip(shape) {
                *entry += weight * one * other;
            }
        }
    });
}

/// Places in a tetrahedron and the volume, signed, that each stands for: exact to degree 7.
pub(super) fn for_each_gauss_point([a, b, c, d]: [DVec3; 4], mut visit: impl FnMut(DVec3, f64)) {
    let whole = volume([a, b, c, d]) * 6.0;
    for (x, wx) in GAUSS {
        for (y, wy) in GAUSS {
            for (z, wz) in GAUSS {
                let (rest, last) = (1.0 - x, (1.0 - x) * (1.0 - y));
                let place = a + (b - a) * x + (c - a) * (rest * y) + (d - a) * (last * z);
                visit(place, whole * wx * wy * wz * rest * last);
            }
        }
    }
}

/// Weights of the corners of the unit box at a place in it.
pub(crate) fn trilinear(u: DVec3) -> [f64; 8] {
    let along = |corner: usize, bit: usize, x: f64| if corner & bit == 0 { 1.0 - x } else { x };
    std::array::from_fn(|i| along(i, 1, u.x) * along(i, 2, u.y) * along(i, 4, u.z))
}
