//! Against closed forms, quadrature of another kind, and each other.

use glam::{DMat3, DQuat, DVec3};
use parry3d_f64::query::PointQuery;
use proptest::array::uniform3;
use proptest::prelude::*;

use super::*;
use crate::collide::Shape;

fn close(a: DMat3, b: DMat3, tolerance: f64) -> bool {
    (a - b).to_cols_array().iter().all(|x| x.abs() <= tolerance)
}

fn same(a: MassProperties, b: MassProperties, tolerance: f64) -> bool {
    let size = (a.moments.x_axis.x + a.moments.y_axis.y + a.moments.z_axis.z) / a.mass;
    (a.mass - b.mass).abs() <= tolerance * a.mass
        && (a.centre - b.centre).length() <= tolerance * (size.sqrt() + a.centre.length())
        && close(a.moments, b.moments, tolerance * a.mass * size)
}

fn corners(half: DVec3) -> Vec<DVec3> {
    let sign = |i: usize, bit: usize| if i & bit == 0 { -1.0 } else { 1.0 };
    (0..8).map(|i| half * DVec3::new(sign(i, 1), sign(i, 2), sign(i, 4))).collect()
}

/// A sum over midpoints of small cubes: about one part in `cells` wrong for the cubes that the surface cuts.
fn voxel_sum(half: DVec3, cells: usize, density: Density, inside: impl Fn(DVec3) -> bool) -> MassProperties {
    let step = half * 2.0 / cells as f64;
    let at = |i: usize, n: usize| -half[n] + (i as f64 + 0.5) * step[n];
    let mut total = Integrals::ZERO;
    for x in 0..cells {
        for y in 0..cells {
            for z in 0..cells {
                let p = DVec3::new(at(x, 0), at(y, 1), at(z, 2));
                if inside(p) {
                    let mass = density.at(p) * step.element_product();
                    total += Integrals { mass, first: p * mass, second: outer(p, p) * mass };
                }
            }
        }
    }
    MassProperties::from_integrals(DVec3::ZERO, total).unwrap()
}

const VARYING: Density = Density { at_origin: 900.0, gradient: DVec3::new(300.0, -500.0, 200.0) };

#[test]
fn solids_agree_with_a_voxel_sum() {
    let (h, r, c) = (0.3, 0.5, 0.12);
    type Case<'a> = (Shape, DVec3, &'a dyn Fn(DVec3) -> bool);
    let cases: [Case; 4] = [
        (Shape::Ball { radius: r }, DVec3::splat(r), &|p| p.length() < r),
        (Shape::Box { half: DVec3::new(0.2, 0.4, 0.3) }, DVec3::new(0.2, 0.4, 0.3), &|_| true),
        (Shape::Capsule { half_length: h, radius: r }, DVec3::new(h + r, r, r), &|p| {
            (p - DVec3::X * p.x.clamp(-h, h)).length() < r
        }),
        (Shape::Cylinder { half_length: h, radius: r, rounding: c }, DVec3::new(r, r, h), &|p| {
            let beyond = (p.x.hypot(p.y) - (r - c)).max(0.0).hypot((p.z.abs() - (h - c)).max(0.0));
            beyond < c
        }),
    ];
    for (shape, half, inside) in cases {
        let exact = shape.mass_properties(VARYING).unwrap();
        let summed = voxel_sum(half, 120, VARYING, inside);
        assert!(same(exact, summed, 1e-3), "{shape:?}\n{exact:?}\n{summed:?}");
    }
}

#[test]
fn inertias_are_those_of_the_tables() {
    let m = 3.0;
    let ball = Shape::Ball { radius: 0.5 }.inertia(m);
    assert!((ball - DVec3::splat(0.4 * m * 0.25)).length() < 1e-14);
    let block = Shape::Box { half: DVec3::new(1.0, 2.0, 3.0) }.inertia(m);
    assert!((block - DVec3::new(13.0, 10.0, 5.0)).length() < 1e-13);
    let disc = Shape::Cylinder { half_length: 0.2, radius: 0.5, rounding: 0.0 }.inertia(m);
    let across = m * (0.25 / 4.0 + 0.04 / 3.0);
    assert!((disc - DVec3::new(across, across, m * 0.125)).length() < 1e-14);
    // A capsule of no length is a ball, and a cylinder rounded all over nearly one.
    let capsule = Shape::Capsule { half_length: 1e-12, radius: 0.5 }.inertia(m);
    assert!((capsule - ball).length() < 1e-11);
    let pill = Shape::Cylinder { half_length: 0.5, radius: 0.5, rounding: 0.5 - 1e-12 }.inertia(m);
    assert!((pill - ball).length() < 1e-11);
    assert_eq!(Shape::HalfSpace { normal: DVec3::Y }.inertia(m), DVec3::ZERO);
}

#[test]
fn a_rounded_hull_agrees_with_a_voxel_sum() {
    let (half, r) = (DVec3::new(0.3, 0.2, 0.1), 0.15);
    let block = Shape::Hull { points: corners(half), radius: r };
    let inside = |p: DVec3| (p - p.clamp(-half, half)).length() < r;
    let exact = block.mass_properties(VARYING).unwrap();
    let summed = voxel_sum(half + r, 120, VARYING, inside);
    assert!(same(exact, summed, 1e-3), "{exact:?}\n{summed:?}");
    // Steiner's polynomial of a box: a closed form for the volume.
    let (a, b, c) = (2.0 * half.x, 2.0 * half.y, 2.0 * half.z);
    let pi = std::f64::consts::PI;
    let steiner = a * b * c + 2.0 * (a * b + b * c + c * a) * r + pi * (a + b + c) * r * r + 4.0 / 3.0 * pi * r.powi(3);
    let volume = block.mass_properties(Density::constant(1.0)).unwrap().mass;
    assert!((volume - steiner).abs() < 1e-14, "{volume} {steiner}");
}

#[test]
fn a_tiny_hull_with_a_large_radius_is_a_ball() {
    let points = vec![DVec3::ZERO, DVec3::X, DVec3::Y, DVec3::Z].into_iter().map(|p| p * 1e-7).collect();
    let nearly = Shape::Hull { points, radius: 0.5 }.mass_properties(VARYING).unwrap();
    let ball = Shape::Ball { radius: 0.5 }.mass_properties(VARYING).unwrap();
    assert!(same(nearly, ball, 1e-6), "{nearly:?}\n{ball:?}");
}

#[test]
fn a_rounded_tetrahedron_agrees_with_a_voxel_sum() {
    let [a, b, c, d] = [[0.4, 0.1, -0.3], [-0.3, 0.5, 0.0], [-0.2, -0.5, -0.1], [0.1, 0.0, 0.4]].map(DVec3::from_array);
    let (r, core) = (0.3, parry3d_f64::shape::Tetrahedron::new(a, b, c, d));
    let inside = |p: DVec3| core.distance_to_local_point(p, true) < r;
    let exact = Shape::Hull { points: vec![a, b, c, d], radius: r }.mass_properties(VARYING).unwrap();
    let summed = voxel_sum(DVec3::splat(0.8), 60, VARYING, inside);
    assert!(same(exact, summed, 3e-3), "{exact:?}\n{summed:?}");
}

#[test]
fn a_thin_hull_with_a_large_radius_is_a_capsule() {
    let rod = |thickness: f64| {
        let points = corners(DVec3::new(0.6, thickness, thickness));
        Shape::Hull { points, radius: 0.3 }.mass_properties(VARYING).unwrap()
    };
    let capsule = Shape::Capsule { half_length: 0.6, radius: 0.3 }.mass_properties(VARYING).unwrap();
    // What is left of the thickness is linear in it: extrapolate.
    let (thick, thin) = (rod(2e-3), rod(1e-3));
    let mass = 2.0 * thin.mass - thick.mass;
    let (centre, moments) = (thin.centre * 2.0 - thick.centre, thin.moments * 2.0 - thick.moments);
    let limit = MassProperties { mass, centre, moments };
    assert!(same(limit, capsule, 1e-4), "{limit:?}\n{capsule:?}");
}

/// Points of a hull of any size, place and form.
fn hull_points() -> impl Strategy<Value = Vec<DVec3>> {
    let points = proptest::collection::vec(uniform3(-1.0..1.0f64), 6..30);
    (points, uniform3(-5.0..5.0f64), uniform3(0.2..2.0f64)).prop_map(|(points, centre, size)| {
        let place = |p: &[f64; 3]| DVec3::from_array(centre) + DVec3::from_array(size) * DVec3::from_array(*p);
        points.iter().map(place).collect()
    })
}

/// A density that is positive within 20 m.
fn density() -> impl Strategy<Value = Density> {
    (500.0..2000.0f64, uniform3(-14.0..14.0f64))
        .prop_map(|(at_origin, g)| Density { at_origin, gradient: DVec3::from_array(g) })
}

fn turn() -> impl Strategy<Value = DQuat> {
    uniform3(-3.0..3.0f64).prop_map(|axis| DQuat::from_scaled_axis(DVec3::from_array(axis)))
}

/// Integrals of tetrahedra by Gauss quadrature: neither the moments' formulas nor their shift.
fn by_quadrature(solid: &Polyhedron, density: Density) -> MassProperties {
    let mut total = Integrals::ZERO;
    for corners in solid.tetrahedra() {
        embedded::for_each_gauss_point(corners, |p, volume| {
            let mass = volume * density.at(p);
            total += Integrals { mass, first: p * mass, second: outer(p, p) * mass };
        });
    }
    MassProperties::from_integrals(DVec3::ZERO, total).unwrap()
}

proptest! {
    #[test]
    fn hulls_agree_with_quadrature(points in hull_points(), density in density()) {
        let solid = Polyhedron::of_hull(&points).unwrap();
        let exact = solid.mass_properties(density).unwrap();
        prop_assert!(same(exact, by_quadrature(&solid, density), 1e-10));
        let shape = Shape::Hull { points, radius: 0.0 };
        prop_assert!(same(exact, shape.mass_properties(density).unwrap(), 1e-12));
    }

    /// Rounding, turning and moving a solid and its density: everything follows.
    #[test]
    fn a_turned_solid_has_turned_moments(
        points in hull_points(),
        density in density(),
        turn in turn(),
        position in uniform3(-3.0..3.0f64),
        radius in 0.0..1.0f64,
    ) {
        let position = DVec3::from_array(position);
        let before = Shape::Hull { points: points.clone(), radius }.mass_properties(density).unwrap();
        let gradient = turn * density.gradient;
        let turned = Density { at_origin: density.at_origin - gradient.dot(position), gradient };
        let points = points.iter().map(|&p| position + turn * p).collect();
        let after = Shape::Hull { points, radius }.mass_properties(turned).unwrap();
        prop_assert!(same(before.moved(position, turn), after, 1e-9), "{before:?} {after:?}");
        let (moments, axes) = before.principal();
        let r = DMat3::from_quat(axes);
        let again = r * DMat3::from_diagonal(moments) * r.transpose();
        prop_assert!(close(again, before.inertia(), 1e-11 * moments.max_element()));
    }

    /// Second moments of a rounded hull are a polynomial of degree 6 in the radius (Steiner): whatever the hull, its
    /// seventh difference vanishes.
    #[test]
    fn moments_are_polynomials_of_the_radius(points in hull_points(), density in density(), r in 0.1..1.0f64) {
        let second = |r: f64| {
            let p = Shape::Hull { points: points.clone(), radius: r }.mass_properties(density).unwrap();
            p.moments + outer(p.centre, p.centre) * p.mass
        };
        let binomials = [1.0, -7.0, 21.0, -35.0, 35.0, -21.0, 7.0, -1.0];
        let terms = (1..).zip(binomials).map(|(k, binomial)| second(r * f64::from(k)) * binomial);
        let difference = terms.fold(DMat3::ZERO, |sum, term| sum + term);
        let size = second(8.0 * r).to_cols_array().iter().fold(0.0, |size: f64, x| size.max(x.abs()));
        prop_assert!(close(difference, DMat3::ZERO, 1e-10 * size), "{difference:?} {size}");
    }

    #[test]
    fn parts_make_the_whole(half in uniform3(0.1..2.0f64), cut in 0.1..0.9f64, density in density()) {
        let half = DVec3::from_array(half);
        let whole = Shape::Box { half }.mass_properties(density).unwrap();
        let piece = |from: f64, to: f64| {
            let (middle, size) = ((from + to) / 2.0, (to - from) / 2.0);
            let shift = DVec3::X * (half.x * middle);
            let shifted = Density { at_origin: density.at(shift), ..density };
            let shape = Shape::Box { half: half * DVec3::new(size, 1.0, 1.0) };
            shape.mass_properties(shifted).unwrap().moved(shift, DQuat::IDENTITY)
        };
        let at = 2.0 * cut - 1.0;
        let both = MassProperties::combined([piece(-1.0, at), piece(at, 1.0)]).unwrap();
        prop_assert!(same(whole, both, 1e-12));
        // Parallel axes: the tensor about a point is that about the centre and that of all the mass in the centre.
        let far = DVec3::new(3.0, -2.0, 1.0);
        let lump = MassProperties::of_point(whole.mass, whole.centre).unwrap();
        let about = whole.inertia() + lump.inertia_about(far);
        prop_assert!(close(about, whole.inertia_about(far), 1e-12 * about.x_axis.x.abs()));
    }

    /// Four points with the part's mass matrix weigh, balance and turn as the part does.
    #[test]
    fn four_points_carry_mass_centre_and_inertia(
        points in hull_points(),
        density in density(),
        origin in uniform3(-2.0..2.0f64),
        turn in turn(),
    ) {
        let props = Shape::Hull { points, radius: 0.1 }.mass_properties(density).unwrap();
        let origin = DVec3::from_array(origin);
        let q = [DVec3::ZERO, DVec3::X, DVec3::Y * 2.0, DVec3::Z * 0.5].map(|p| origin + turn * p);
        let m = embedded_mass(&q, &props).unwrap();
        let mut again = Integrals::ZERO;
        for i in 0..4 {
            for j in 0..4 {
                let (mass, first) = (m[i][j], (q[i] + q[j]) * (m[i][j] / 2.0));
                again += Integrals { mass, first, second: outer(q[i], q[j]) * m[i][j] };
            }
        }
        let again = MassProperties::from_integrals(DVec3::ZERO, again).unwrap();
        prop_assert!(same(props, again, 1e-9), "{props:?} {again:?}");
    }

    #[test]
    fn a_tetrahedron_weighs_the_same_as_element_and_as_part(points in proptest::array::uniform4(uniform3(-1.0..1.0f64)), density in density()) {
        let corners = points.map(DVec3::from_array);
        prop_assume!(integrals::volume(corners).abs() > 1e-3);
        let props = Polyhedron::of_hull(&corners).unwrap().mass_properties(density).unwrap();
        let (as_part, as_element) = (embedded_mass(&corners, &props).unwrap(), tetrahedron_mass(&corners, density).unwrap());
        for (a, b) in as_part.iter().flatten().zip(as_element.iter().flatten()) {
            prop_assert!((a - b).abs() < 1e-10 * props.mass, "{a} {b}");
        }
    }

    /// The cells of a lattice share the solid among them, and carry its mass, centre and moments.
    #[test]
    fn a_lattice_carries_what_is_embedded_in_it(points in hull_points(), density in density()) {
        let solid = Polyhedron::of_hull(&points).unwrap();
        let props = solid.mass_properties(density).unwrap();
        let min = points.iter().copied().reduce(DVec3::min).unwrap() - 0.1;
        let size = points.iter().copied().reduce(DVec3::max).unwrap() + 0.1 - min;
        let mut total = Integrals::ZERO;
        for cell in 0..8 {
            let corner = |i: usize| DVec3::new((i & 1) as f64, (i >> 1 & 1) as f64, (i >> 2 & 1) as f64);
            let from = min + corner(cell) * size / 2.0;
            let m = lattice_cell_mass(from, from + size / 2.0, &solid, density).unwrap();
            let q: [DVec3; 8] = std::array::from_fn(|i| from + corner(i) * size / 2.0);
            for i in 0..8 {
                for j in 0..8 {
                    prop_assert!((m[i][j] - m[j][i]).abs() < 1e-12 * props.mass);
                    total += Integrals { mass: m[i][j], first: q[i] * m[i][j], second: outer(q[i], q[j]) * m[i][j] };
                }
            }
        }
        let again = MassProperties::from_integrals(DVec3::ZERO, total).unwrap();
        prop_assert!(same(props, again, 1e-9), "{props:?} {again:?}");
    }
}

#[test]
fn a_full_cell_has_the_tensor_product_of_beams() {
    let half = DVec3::new(0.5, 1.0, 0.25);
    let solid = Polyhedron::of_hull(&corners(half)).unwrap();
    let m = lattice_cell_mass(-half, half, &solid, Density::constant(2.0)).unwrap();
    for (i, row) in m.iter().enumerate() {
        for (j, entry) in row.iter().enumerate() {
            // 1/3 along an axis where both corners lie on one side, else 1/6.
            let apart = (i ^ j).count_ones() as i32;
            let expected = 2.0 / 27.0 * 0.5f64.powi(apart);
            assert!((entry - expected).abs() < 1e-15, "{i} {j}: {entry} {expected}");
        }
    }
}

#[test]
fn a_surface_need_not_be_convex() {
    // An L: a cube of side 2 without a quarter, extruded along z; ears first, so that nothing is a fan of one point.
    let outline = [(0.0, 0.0), (2.0, 0.0), (2.0, 1.0), (1.0, 1.0), (1.0, 2.0), (0.0, 2.0)];
    let points: Vec<DVec3> = [0.0, 1.0].iter().flat_map(|&z| outline.map(|(x, y)| DVec3::new(x, y, z))).collect();
    let mut triangles = vec![];
    for [a, b, c] in [[0, 1, 2], [0, 2, 3], [0, 3, 4], [0, 4, 5]] {
        triangles.push([a + 6, b + 6, c + 6]);
        triangles.push([c, b, a]);
    }
    for i in 0..6 {
        let j = (i + 1) % 6;
        triangles.push([i, j, j + 6]);
        triangles.push([i, j + 6, i + 6]);
    }
    let solid = Polyhedron::of_surface(points.clone(), triangles.clone()).unwrap();
    let density = Density { at_origin: 5.0, gradient: DVec3::new(1.0, -1.0, 0.5) };
    let cube = |x: f64, y: f64| {
        let at = DVec3::new(x, y, 0.5);
        let moved = Density { at_origin: density.at(at), ..density };
        let unit = Shape::Box { half: DVec3::splat(0.5) };
        unit.mass_properties(moved).unwrap().moved(at, DQuat::IDENTITY)
    };
    let parts = MassProperties::combined([cube(0.5, 0.5), cube(1.5, 0.5), cube(0.5, 1.5)]).unwrap();
    assert!(same(parts, solid.mass_properties(density).unwrap(), 1e-13));
    let reversed = triangles.iter().map(|&[a, b, c]| [c, b, a]).collect();
    assert!(Polyhedron::of_surface(points.clone(), reversed).unwrap_err().to_string().contains("face outwards"));
    triangles.pop();
    assert!(Polyhedron::of_surface(points.clone(), triangles.clone()).unwrap_err().to_string().contains("not closed"));
    triangles.push([0, 1, 12]);
    assert!(Polyhedron::of_surface(points, triangles).unwrap_err().to_string().contains("corner of a triangle is 12"));
}

#[test]
fn what_has_no_mass_is_refused_by_name() {
    let refused = |shape: Shape, density: Density| shape.mass_properties(density).unwrap_err().to_string();
    let ball = || Shape::Ball { radius: 0.5 };
    assert!(refused(ball(), Density::constant(0.0)).contains("density is 0"));
    assert!(refused(ball(), Density::constant(f64::NAN)).contains("density is NaN"));
    assert!(refused(ball(), Density { at_origin: 1.0, gradient: DVec3::X * 2.1 }).contains("density is -0.05"));
    assert!(refused(ball(), Density { at_origin: 1.0, gradient: DVec3::NAN }).contains("gradient of the density"));
    assert!(refused(Shape::Ball { radius: -1.0 }, Density::constant(1.0)).contains("radius is -1"));
    assert!(refused(Shape::HalfSpace { normal: DVec3::Y }, Density::constant(1.0)).contains("half-space has no mass"));
    // Thin enough for parry to call it flat.
    let mut sheet = corners(DVec3::new(1.0, 1.0, 1e-5));
    assert!(refused(Shape::Hull { points: sheet.clone(), radius: 0.1 }, Density::constant(1.0)).contains("in a plane"));
    sheet[0] = DVec3::INFINITY;
    assert!(refused(Shape::Hull { points: sheet, radius: 0.1 }, Density::constant(1.0)).contains("points is NaN"));
    let props = ball().mass_properties(Density::constant(1.0)).unwrap();
    assert!(props.scaled_to(0.0).is_err());
    assert!(MassProperties::of_point(-1.0, DVec3::ZERO).is_err());
    assert!(MassProperties::combined([]).is_err());
    let plane = [DVec3::ZERO, DVec3::X, DVec3::Y, DVec3::X + DVec3::Y];
    assert!(embedded_mass(&plane, &props).unwrap_err().to_string().contains("plane"));
    assert!(tetrahedron_mass(&plane, Density::constant(1.0)).is_err());
    let solid = Polyhedron::of_hull(&corners(DVec3::ONE)).unwrap();
    assert!(lattice_cell_mass(DVec3::ONE, DVec3::ZERO, &solid, Density::constant(1.0)).is_err());
    assert!(lattice_cell_mass(DVec3::ZERO, DVec3::ONE, &solid, Density::constant(-1.0)).is_err());
}

#[test]
fn needles_on_a_surface_change_nothing() {
    // Many points in the faces and on the edges of a box: the hull is full of flat and thin triangles.
    let half = DVec3::new(0.5, 0.4, 0.3);
    let mut points = corners(half);
    for i in 0..40 {
        let t = f64::from(i) / 40.0 * 1.9 - 0.95;
        points.push(half * DVec3::new(t, 1.0, 1.0));
        points.push(half * DVec3::new(t, 1.0, 0.3 + 1e-9 * t));
        points.push(half * DVec3::new(-1.0, t, 0.5 * t));
    }
    let many = Shape::Hull { points, radius: 0.1 }.mass_properties(VARYING).unwrap();
    let few = Shape::Hull { points: corners(half), radius: 0.1 }.mass_properties(VARYING).unwrap();
    assert!(same(few, many, 1e-7), "{few:?}\n{many:?}");
}
