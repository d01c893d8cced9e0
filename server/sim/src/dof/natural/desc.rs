//! What a figure in natural coordinates is made of, and what is refused.

use glam::{DQuat, DVec3};

use super::embedding::Embedding;
use crate::dof::{PointMasses, PointRod};
use crate::error::{SimError, require, require_rotation, require_vector};
use crate::mass::MassProperties;
use crate::potential::hold::{TOLERANCE, require_tolerance};

/// Most points of a figure.
pub const POINTS_MAX: usize = 256;

/// Most rods of a figure: designers enjoy over-determined systems.
pub const RODS_MAX: usize = 4096;

/// In how many points a part may be embedded.
pub(super) const EMBEDDED_IN: &str = "a part is embedded in 1, 2 or 4 points";

/// Shortest rod, m.
const SHORTEST: f64 = 1e-6;

/// Least pivot of the mass matrix, as a fraction of its diagonal.
const LEAST_PIVOT: f64 = 1e-9;

/// A figure in natural coordinates, in the arrangement in which its rods have their lengths.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct NaturalDesc {
    /// Points, in the figure's frame, m.
    pub points: Vec<DVec3>,
    /// Distances of points that are held.
    pub rods: Vec<PointRod>,
    /// What the points carry. Every point carries something.
    pub parts: Vec<NaturalPart>,
}

/// A rigid part embedded in points.
#[derive(Clone, Debug, PartialEq)]
pub struct NaturalPart {
    /// What messages call it.
    pub name: String,
    /// The points that it is embedded in: four, with rods between them all; or two, for a rod with mass, which turns with
    /// their line and never about it; or one.
    pub points: Vec<u32>,
    /// Of the part's frame, in the figure's, m.
    pub position: DVec3,
    /// Turns the part's axes into the figure's.
    pub rotation: DQuat,
    /// In the part's frame. Of a part in two points only its spread along their line counts, of one in one point only its
    /// mass.
    pub mass: MassProperties,
}

impl PointRod {
    /// A rod that holds its length, m, to a millimetre.
    pub fn new(points: [u32; 2], length: f64) -> Self {
        Self { points, length, tolerance: TOLERANCE }
    }
}

impl NaturalDesc {
    /// Adds rods, as long as points are apart now, between every two points of a part that have none: six for a
    /// tetrahedron.
    #[must_use]
    pub fn with_edges(mut self) -> Self {
        for part in &self.parts {
            for (i, &a) in part.points.iter().enumerate() {
                for &b in &part.points[..i] {
                    let ends = [a, b].map(|point| self.points.get(point as usize));
                    if let [Some(p), Some(q)] = ends
                        && !self.has_rod(a, b)
                    {
                        self.rods.push(PointRod::new([b, a], p.distance(*q)));
                    }
                }
            }
        }
        self
    }

    fn has_rod(&self, a: u32, b: u32) -> bool {
        self.rods.iter().any(|rod| rod.points == [a, b] || rod.points == [b, a])
    }

    /// # Errors
    /// [`SimError`] naming the item.
    pub(super) fn validate(&self) -> Result<(), SimError> {
        let (points, rods) = (self.points.len(), self.rods.len());
        require((1..=POINTS_MAX).contains(&points), "number of points", points as f64, "1 to 256")?;
        require(rods <= RODS_MAX, "number of rods", rods as f64, "0 to 4096")?;
        for (i, &point) in self.points.iter().enumerate() {
            require_vector(point, "position").map_err(|reason| reason.of(format!("point {i}")))?;
        }
        for (i, rod) in self.rods.iter().enumerate() {
            let [a, b] = rod.points;
            self.check_rod(rod).map_err(|reason| reason.of(format!("rod {i} (points {a} and {b})")))?;
        }
        for (i, part) in self.parts.iter().enumerate() {
            self.check_part(part).map_err(|reason| reason.of(part.called(i)))?;
        }
        self.check_connections()
    }

    fn check_point(&self, point: u32) -> Result<DVec3, SimError> {
        let known = self.points.get(point as usize).copied();
        require(known.is_some(), "point", f64::from(point), "the index of one of the figure's points")?;
        Ok(known.unwrap_or_default())
    }

    fn check_rod(&self, rod: &PointRod) -> Result<(), SimError> {
        let distance = self.check_point(rod.points[0])?.distance(self.check_point(rod.points[1])?);
        if rod.points[0] == rod.points[1] {
            return Err(SimError::Unusable { what: "both ends are at the same point" });
        }
        require((SHORTEST..1e9).contains(&rod.length), "length", rod.length, "1e-6 to below 1e9 m")?;
        require_tolerance(rod.tolerance)?;
        let agrees = (distance - rod.length).abs() <= rod.tolerance;
        require(agrees, "length", rod.length, "the distance of its points, within its tolerance")
    }

    fn check_part(&self, part: &NaturalPart) -> Result<(), SimError> {
        if !matches!(part.points.len(), 1 | 2 | 4) {
            return Err(SimError::Unusable { what: EMBEDDED_IN });
        }
        for (i, &a) in part.points.iter().enumerate() {
            self.check_point(a)?;
            let (repeated, loose) =
                part.points[..i].iter().fold((false, false), |(r, l), &b| (r || a == b, l || !self.has_rod(a, b)));
            if repeated {
                return Err(SimError::Unusable { what: "it is embedded in a point twice" });
            }
            if loose {
                return Err(SimError::Unusable { what: "two of its points have no rod between them" });
            }
        }
        require_vector(part.position, "position")?;
        require_rotation(part.rotation, "rotation")?;
        let MassProperties { mass, centre, moments } = part.mass;
        require((1e-6..1e9).contains(&mass), "mass", mass, "1e-6 to below 1e9 kg")?;
        require_vector(centre, "centre of mass")?;
        [moments.x_axis, moments.y_axis, moments.z_axis].iter().try_for_each(|&m| require_vector(m, "moments"))
    }

    /// Everything hangs together.
    fn check_connections(&self) -> Result<(), SimError> {
        let mut reached = vec![false; self.points.len()];
        let mut open = vec![0];
        reached[0] = true;
        while let Some(point) = open.pop() {
            for rod in self.rods.iter().filter(|rod| rod.points.contains(&point)) {
                for other in rod.points {
                    if !std::mem::replace(&mut reached[other as usize], true) {
                        open.push(other);
                    }
                }
            }
        }
        match reached.iter().position(|&reached| !reached) {
            None => Ok(()),
            Some(point) => {
                let what = "no rods lead from here to point 0: what does not hang together is several bodies";
                Err(SimError::Unusable { what }.of(format!("point {point}")))
            }
        }
    }

    /// The parts' embeddings and the mass matrix of all.
    ///
    /// # Errors
    /// [`SimError`] naming the part or the point.
    pub(super) fn embed(&self) -> Result<(Vec<Embedding>, PointMasses), SimError> {
        let mut masses = PointMasses::new(self.points.len());
        let embed = |(i, part): (usize, &NaturalPart)| {
            part.embed(&self.points, &mut masses).map_err(|reason| reason.of(part.called(i)))
        };
        let embeddings = self.parts.iter().enumerate().map(embed).collect::<Result<_, _>>()?;
        check_masses(&masses)?;
        Ok((embeddings, masses))
    }
}

impl NaturalPart {
    fn called(&self, index: usize) -> String {
        format!("part {index} ({})", self.name)
    }

    fn embed(&self, points: &[DVec3], masses: &mut PointMasses) -> Result<Embedding, SimError> {
        let to_part = self.rotation.normalize().inverse();
        let places: Vec<_> = self.points.iter().map(|&p| to_part * (points[p as usize] - self.position)).collect();
        let embedding = Embedding::new(&places)?;
        let m = embedding.masses(&places, &self.mass)?;
        for (i, &p) in self.points.iter().enumerate() {
            for (j, &q) in self.points.iter().enumerate() {
                masses.add_entry(p, q, m[i * self.points.len() + j]);
            }
        }
        Ok(embedding)
    }
}

/// The mass matrix is positive definite: its Cholesky factor exists.
fn check_masses(masses: &PointMasses) -> Result<(), SimError> {
    let n = masses.diagonal.len();
    let mut l = vec![0.0; n * n];
    for &(i, j, m) in &masses.off_diagonal {
        l[i as usize * n + j as usize] = m;
    }
    for i in 0..n {
        for j in 0..=i {
            let entry = if i == j { masses.diagonal[i] } else { l[i * n + j] };
            let rest = entry - (0..j).map(|k| l[i * n + k] * l[j * n + k]).sum::<f64>();
            let definite = rest > LEAST_PIVOT * entry && entry > 0.0;
            if i == j && !definite {
                let what = "has no mass of its own: embed a part here, or one that is not so thin";
                return Err(SimError::Unusable { what }.of(format!("point {i}")));
            }
            l[i * n + j] = if i == j { rest.sqrt() } else { rest / l[j * n + j] };
        }
    }
    Ok(())
}
