//! What an extrusion radius adds to a convex hull (talk: "points become spheres, edges become cylinders, faces are
//! still faces"): prisms on faces, wedges of cylinders on edges, sectors of balls on vertices, each integrated in closed
//! form. The sectors' integrals over spherical polygons follow from the divergence theorem on the sphere.

use glam::{DMat3, DVec3};

use super::Density;
use super::integrals::{Integrals, VolumeMoments, prism, tetrahedron};
use super::polyhedron::{Polyhedron, left_of};
use crate::error::SimError;
use crate::potential::outer;

/// A triangle lower than this fraction of its longest side has no normal of its own.
const FLATTEST_TRIANGLE: f64 = 1e-7;

/// Integrals over the shell of thickness `radius` around a convex hull, from its middle.
///
/// # Errors
/// [`SimError::Unusable`] where the surface is not closed.
pub(super) fn shell(hull: &Polyhedron, radius: f64, density: Density) -> Result<Integrals, SimError> {
    let edges = hull.edges()?;
    let normals = normals(hull, &edges);
    let mut total = Integrals::ZERO;
    let weigh =
        |piece: VolumeMoments, at: DVec3| piece.weighed(density.at(at), density.gradient).seen_from(at - hull.middle());
    for (face, &normal) in hull.faces().zip(&normals) {
        for corners in prism(face, face.map(|p| p + normal * radius)) {
            let densities = corners.map(|p| density.at(p));
            total += tetrahedron(corners.map(|p| p - hull.middle()), densities);
        }
    }
    for &(a, b, left) in edges.iter().filter(|edge| edge.0 < edge.1) {
        let right = left_of(&edges, b, a).unwrap_or(left);
        let (start, end) = (hull.point(a), hull.point(b));
        if let Some(arc) = Arc::between(normals[left as usize], normals[right as usize]) {
            total += weigh(wedge(&arc, (end - start).length(), radius, density.gradient), (start + end) / 2.0);
        }
    }
    for ring in edges.chunk_by(|one, next| one.0 == next.0) {
        let vertex = ring[0].0;
        let around = normals_around(hull, &edges, ring[0], &normals);
        total += weigh(sector(&around, radius), hull.point(vertex));
    }
    Ok(total)
}

/// Outer unit normal of every triangle. A needle has that of its neighbour across its longest side, in whose plane it
/// lies.
fn normals(hull: &Polyhedron, edges: &[(u32, u32, u32)]) -> Vec<DVec3> {
    let of = |[a, b, c]: [DVec3; 3]| {
        let (area, longest) = ((b - a).cross(c - a), (b - a).length().max((c - b).length()).max((a - c).length()));
        if area.length() > FLATTEST_TRIANGLE * longest * longest { area.normalize() } else { DVec3::ZERO }
    };
    let mut normals: Vec<DVec3> = hull.faces().map(of).collect();
    // Needles may lie side by side; each pass serves at least the next one.
    for _ in 0..normals.len() {
        let Some(needle) = normals.iter().position(|&n| n == DVec3::ZERO) else { break };
        let [a, b, c] = hull.triangles()[needle];
        let length = |(a, b): &(u32, u32)| (hull.point(*b) - hull.point(*a)).length();
        let longest = [(a, b), (b, c), (c, a)].into_iter().max_by(|x, y| length(x).total_cmp(&length(y)));
        let neighbour = longest.and_then(|(a, b)| left_of(edges, b, a));
        let normal = neighbour.map_or(DVec3::ZERO, |t| normals[t as usize]);
        normals[needle] = if normal == DVec3::ZERO { DVec3::X } else { normal };
    }
    normals
}

/// Normals of the triangles around the start of `first`, counterclockwise.
fn normals_around(
    hull: &Polyhedron,
    edges: &[(u32, u32, u32)],
    first: (u32, u32, u32),
    normals: &[DVec3],
) -> Vec<DVec3> {
    let (vertex, _, start) = first;
    let mut around = vec![normals[start as usize]];
    let mut triangle = start;
    for _ in 0..hull.triangles().len() {
        let corners = hull.triangles()[triangle as usize];
        let place = corners.iter().position(|&corner| corner == vertex).unwrap_or(0);
        let before = corners[(place + 2) % 3];
        let Some(next) = left_of(edges, vertex, before).filter(|&next| next != start) else { break };
        around.push(normals[next as usize]);
        triangle = next;
    }
    around
}

/// An arc of the unit circle between two directions.
struct Arc {
    /// rad.
    angle: f64,
    /// Unit normal of the circle's plane; the arc turns counterclockwise about it.
    axis: DVec3,
    /// Middle of the arc.
    middle: DVec3,
    /// Unit tangent there.
    tangent: DVec3,
}

impl Arc {
    /// `None` where the directions are the same, or opposite.
    fn between(from: DVec3, to: DVec3) -> Option<Self> {
        let cross = from.cross(to);
        let axis = cross.try_normalize()?;
        let middle = (from + to).try_normalize()?;
        Some(Self { angle: cross.length().atan2(from.dot(to)), axis, middle, tangent: axis.cross(middle) })
    }

    /// ∫u along the arc.
    fn first(&self) -> DVec3 {
        self.middle * (2.0 * (self.angle / 2.0).sin())
    }

    /// ∫u uᵀ along the arc.
    fn second(&self) -> DMat3 {
        let sine = self.angle.sin();
        let (along, across) = ((self.angle + sine) / 2.0, (self.angle - sine) / 2.0);
        outer(self.middle, self.middle) * along + outer(self.tangent, self.tangent) * across
    }

    /// ∫(g·u) u uᵀ along the arc.
    fn third(&self, g: DVec3) -> DMat3 {
        let sine = (self.angle / 2.0).sin();
        let across = 2.0 / 3.0 * sine.powi(3);
        let along = 2.0 * sine - across;
        let (m, t) = (self.middle, self.tangent);
        let mixed = outer(m, t) + outer(t, m);
        (outer(m, m) * along + outer(t, t) * across) * g.dot(m) + mixed * (across * g.dot(t))
    }
}

/// A wedge of a cylinder of `length` about the arc's axis, from the middle of that axis.
fn wedge(arc: &Arc, length: f64, r: f64, g: DVec3) -> VolumeMoments {
    let e = arc.axis;
    let area = arc.angle * r.powi(2) / 2.0;
    let first = arc.first() * (r.powi(3) / 3.0);
    let stretch = length.powi(3) / 12.0;
    let mixed = outer(e, first) + outer(first, e);
    VolumeMoments {
        volume: length * area,
        first: first * length,
        second: arc.second() * (length * r.powi(4) / 4.0) + outer(e, e) * (stretch * area),
        third: arc.third(g) * (length * r.powi(5) / 5.0) + (outer(e, e) * g.dot(first) + mixed * g.dot(e)) * stretch,
    }
}

/// A sector of a ball over the spherical polygon with these corners, counterclockwise, from the ball's centre.
///
/// With n on the polygon, µ the inner normals of its arcs and dl along them: ∫n = ½ Σ ∫µ dl and
/// ∫n nᵀ = ⅓ (Ω + Σ ∫n µᵀ dl). The third moment is left out: together the sectors of a hull make a ball, which has none.
fn sector(corners: &[DVec3], r: f64) -> VolumeMoments {
    let following = corners.iter().cycle().skip(1);
    let solid_angle: f64 = corners.windows(2).map(|pair| spherical_triangle([corners[0], pair[0], pair[1]])).sum();
    let mut first = DVec3::ZERO;
    let mut second = DMat3::from_diagonal(DVec3::splat(solid_angle));
    for arc in corners.iter().zip(following).filter_map(|(&from, &to)| Arc::between(from, to)) {
        first += arc.axis * (arc.angle / 2.0);
        second += outer(arc.first(), arc.axis);
    }
    VolumeMoments {
        volume: solid_angle * r.powi(3) / 3.0,
        first: first * (r.powi(4) / 4.0),
        second: symmetric(second) * (r.powi(5) / 15.0),
        third: DMat3::ZERO,
    }
}

/// Solid angle (van Oosterom and Strackee 1983).
fn spherical_triangle([a, b, c]: [DVec3; 3]) -> f64 {
    2.0 * a.dot(b.cross(c)).atan2(1.0 + a.dot(b) + b.dot(c) + c.dot(a))
}

/// The two halves differ by rounding only.
fn symmetric(m: DMat3) -> DMat3 {
    (m + m.transpose()) * 0.5
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The sum over a wedge's small cells, by the midpoint rule.
    #[test]
    fn a_wedge_agrees_with_a_sum_over_its_cells() {
        let arc = Arc::between(DVec3::X, DVec3::new(-0.4, 0.5, 0.6).normalize()).unwrap();
        let (length, r, g) = (0.8, 0.5, DVec3::new(1.0, 2.0, -0.7));
        let exact = wedge(&arc, length, r, g);
        let (mut volume, mut first) = (0.0, DVec3::ZERO);
        let (mut second, mut third) = (DMat3::ZERO, DMat3::ZERO);
        let middles = || (0..60).map(|i| (f64::from(i) + 0.5) / 60.0);
        for (theta, height) in middles().flat_map(|a| middles().map(move |b| ((a - 0.5) * arc.angle, b - 0.5))) {
            for part in middles() {
                let away = arc.middle * theta.cos() + arc.tangent * theta.sin();
                let x = away * (part * r) + arc.axis * (height * length);
                let cell = arc.angle * length * r * (part * r) / 60f64.powi(3);
                volume += cell;
                first += x * cell;
                second += outer(x, x) * cell;
                third += outer(x, x) * (cell * g.dot(x));
            }
        }
        let near = |a: DMat3, b: DMat3| (a - b).to_cols_array().iter().all(|x| x.abs() < 1e-4 * volume);
        assert!((exact.volume - volume).abs() < 1e-4 * volume && (exact.first - first).length() < 1e-4 * volume);
        assert!(near(exact.second, second) && near(exact.third, third), "{:?}\n{third:?}", exact.third);
    }
}
