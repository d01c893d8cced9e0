//! The slow reference: signed distance of two convex solids, by other means than the engine's.
//!
//! Apart: Wolfe's minimum norm point over the Minkowski difference, with a certificate (a plane that separates them at
//! the distance found). Overlapping: the least overlap over the normals of all triples of vertices and the cross
//! products of all pairs of edges; where a core is round, over a fan of directions, the best of them polished.

use pita_sim::DVec3;

/// A convex core in world space.
#[derive(Clone, Debug)]
pub enum Core {
    /// The hull of points.
    Points(Vec<DVec3>),
    /// A cylinder.
    Cylinder {
        /// m.
        centre: DVec3,
        /// Unit vector.
        axis: DVec3,
        /// Half length, m.
        half: f64,
        /// m.
        radius: f64,
    },
}

/// A core and its extrusion radius, m.
#[derive(Clone, Debug)]
pub struct Solid {
    /// What is extruded.
    pub core: Core,
    /// m.
    pub radius: f64,
}

/// Signed distance of two solids.
#[derive(Clone, Copy, Debug)]
pub struct Answer {
    /// m; negative where they overlap.
    pub gap: f64,
    /// Unit vector from the first to the second along which it is measured.
    pub normal: DVec3,
    /// How far the reference may be off, m.
    pub uncertainty: f64,
}

impl Core {
    /// The point farthest along `d`.
    pub fn support(&self, d: DVec3) -> DVec3 {
        match self {
            Self::Points(points) => {
                let farther = |a: DVec3, &b: &DVec3| if b.dot(d) > a.dot(d) { b } else { a };
                points[1..].iter().fold(points[0], farther)
            }
            Self::Cylinder { centre, axis, half, radius } => {
                // Along the axis what is left is rounding, and has to be made orthogonal once more.
                let across = d.reject_from_normalized(*axis).reject_from_normalized(*axis).normalize_or_zero();
                let across = across.reject_from_normalized(*axis).normalize_or_zero();
                centre + axis * half.copysign(d.dot(*axis)) + across * *radius
            }
        }
    }

    fn points(&self) -> &[DVec3] {
        match self {
            Self::Points(points) => points,
            Self::Cylinder { .. } => &[],
        }
    }

    fn is_round(&self) -> bool {
        matches!(self, Self::Cylinder { .. })
    }
}

/// Separation of the cores along unit `n`: positive where a plane across it has one on either side.
pub fn separation(a: &Core, b: &Core, n: DVec3) -> f64 {
    (b.support(-n) - a.support(n)).dot(n)
}

/// Signed distance of two solids.
pub fn signed_distance(a: &Solid, b: &Solid) -> Answer {
    let radii = a.radius + b.radius;
    let x = minimum_norm(&a.core, &b.core);
    let length = x.length();
    let scale = size(&a.core) + size(&b.core) + length;
    if length > 1e-11 * scale {
        let normal = x / length;
        let apart = separation(&a.core, &b.core, normal);
        if apart > 0.0 {
            return Answer { gap: length - radii, normal, uncertainty: length - apart };
        }
    }
    let (depth, normal) = least_overlap(&a.core, &b.core);
    // A round core's is an upper bound. Of cores that are apart it is no distance at all.
    Answer { gap: depth - radii, normal, uncertainty: depth.max(0.0) }
}

fn size(core: &Core) -> f64 {
    DVec3::AXES.map(|d| (core.support(d) - core.support(-d)).dot(d)).into_iter().fold(0.0, f64::max)
}

/// Wolfe's algorithm: the point of b − a that is nearest to the origin.
fn minimum_norm(a: &Core, b: &Core) -> DVec3 {
    let vertex = |d: DVec3| b.support(d) - a.support(-d);
    let mut corral: Vec<DVec3> = vec![vertex(DVec3::X)];
    let mut weights = vec![1.0];
    let mut x = corral[0];
    let mut best = x;
    for _ in 0..1000 {
        let new = vertex(-x);
        let scale = x.length_squared().max(new.length_squared());
        if x.dot(x - new) <= 1e-15 * scale.max(1e-30) || corral.contains(&new) {
            break;
        }
        corral.push(new);
        weights.push(0.0);
        while let Some(target) = affine_minimum(&corral) {
            if target.iter().all(|&w| w > 1e-13) {
                weights = target;
                break;
            }
            let falling = weights.iter().zip(&target).filter(|&(_, t)| *t <= 1e-13);
            let step = falling.map(|(w, t)| if w > t { w / (w - t) } else { 0.0 }).fold(1.0, f64::min);
            for (w, t) in weights.iter_mut().zip(&target) {
                *w += step * (t - *w);
            }
            let least = (0..weights.len()).min_by(|&i, &j| weights[i].total_cmp(&weights[j])).unwrap_or(0);
            let keep: Vec<bool> = (0..weights.len()).map(|i| i != least && weights[i] > 1e-14).collect();
            let mut kept = keep.iter();
            corral.retain(|_| *kept.next().unwrap_or(&true));
            let mut kept = keep.iter();
            weights.retain(|_| *kept.next().unwrap_or(&true));
        }
        x = corral.iter().zip(&weights).map(|(&p, &w)| p * w).sum();
        if x.length_squared() < best.length_squared() {
            best = x;
        }
        if corral.len() == 4 {
            if x.length_squared() <= 1e-20 * scale {
                // The origin is inside.
                return DVec3::ZERO;
            }
            // Rounding: four points as good as in a plane.
            let least = (0..4).min_by(|&i, &j| weights[i].total_cmp(&weights[j])).unwrap_or(0);
            corral.swap_remove(least);
            weights.swap_remove(least);
        }
    }
    best
}

/// Weights of the point nearest to the origin in the affine hull of up to four points; `None` where there is none.
fn affine_minimum(points: &[DVec3]) -> Option<Vec<f64>> {
    // Orthogonal directions of the hull by Gram and Schmidt with pivoting; then back substitution.
    let origin = points[0];
    let edges: Vec<DVec3> = points[1..].iter().map(|p| p - origin).collect();
    match *edges.as_slice() {
        [] => Some(vec![1.0]),
        [u] => {
            let t = -origin.dot(u) / u.length_squared();
            t.is_finite().then(|| vec![1.0 - t, t])
        }
        [u, v] => {
            let n = u.cross(v);
            let n2 = n.length_squared();
            let (s, t) = (-n.dot(origin.cross(v)) / n2, -n.dot(u.cross(origin)) / n2);
            (s.is_finite() && t.is_finite()).then(|| vec![1.0 - s - t, s, t])
        }
        [u, v, w] => {
            let volume = u.dot(v.cross(w));
            let s = -origin.dot(v.cross(w)) / volume;
            let t = -u.dot(origin.cross(w)) / volume;
            let r = -u.dot(v.cross(origin)) / volume;
            [s, t, r].iter().all(|x| x.is_finite()).then(|| vec![1.0 - s - t - r, s, t, r])
        }
        _ => None,
    }
}

/// Largest separation of overlapping cores (negative: minus the depth) and its direction.
fn least_overlap(a: &Core, b: &Core) -> (f64, DVec3) {
    let mut best = (f64::NEG_INFINITY, DVec3::X);
    let mut look = |n: DVec3| {
        if let Some(n) = n.try_normalize() {
            for n in [n, -n] {
                let apart = separation(a, b, n);
                if apart > best.0 {
                    best = (apart, n);
                }
            }
        }
    };
    DVec3::AXES.into_iter().for_each(&mut look);
    let edges = |points: &[DVec3]| -> Vec<DVec3> {
        points.iter().enumerate().flat_map(|(i, &p)| points[..i].iter().map(move |&q| p - q)).collect()
    };
    for points in [a.points(), b.points()] {
        for (i, &p) in points.iter().enumerate() {
            for (j, &q) in points[..i].iter().enumerate() {
                points[..j].iter().for_each(|&r| look((q - p).cross(r - p)));
            }
        }
    }
    let (ea, eb) = (edges(a.points()), edges(b.points()));
    for &u in &ea {
        eb.iter().for_each(|&v| look(u.cross(v)));
    }
    // Of lines that lie in each other.
    ea.iter().chain(&eb).for_each(|u| look(u.any_orthogonal_vector()));
    if a.is_round() || b.is_round() {
        for i in 0..2000 {
            let (height, turn) = ((f64::from(i) + 0.5) / 1000.0 - 1.0, f64::from(i) * 2.399_963_229_728_653);
            let across = (1.0 - height * height).sqrt();
            look(DVec3::new(across * turn.cos(), height, across * turn.sin()));
        }
        return polished(a, b, best);
    }
    best
}

/// Pattern search around a direction.
fn polished(a: &Core, b: &Core, mut best: (f64, DVec3)) -> (f64, DVec3) {
    let mut step = 0.05;
    while step > 1e-9 {
        let (u, v) = best.1.any_orthonormal_pair();
        let around = (0..8).map(|k| f64::from(k) * std::f64::consts::FRAC_PI_4);
        let tries = around.map(|t| (best.1 + step * (u * t.cos() + v * t.sin())).normalize());
        let better = tries.map(|n| (separation(a, b, n), n)).max_by(|x, y| x.0.total_cmp(&y.0));
        match better.filter(|better| better.0 > best.0) {
            Some(better) => best = better,
            None => step *= 0.5,
        }
    }
    best
}
