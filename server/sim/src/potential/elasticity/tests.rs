//! Three ways: the formulas, automatic differentiation, finite differences; and in closed form where there is one.

use glam::{DMat3, DQuat, DVec3};
use proptest::array::{uniform3, uniform4};
use proptest::prelude::*;

use super::*;
use crate::autodiff::{Dual, Vec3};
use crate::mesh::TetrahedralMesh;

const RUBBER: Elastic = Elastic { lambda: 3e5, mu: 2e5 };

/// With this element at rest, F is the matrix of the last three nodes and its volume 1/6.
fn unit_element() -> Tetrahedron {
    Tetrahedron::new([0, 1, 2, 3], [DVec3::ZERO, DVec3::X, DVec3::Y, DVec3::Z]).unwrap()
}

fn nodes_of(f: DMat3) -> [DVec3; 4] {
    [DVec3::ZERO, f.x_axis, f.y_axis, f.z_axis]
}

fn numbers(m: DMat3) -> [f64; 9] {
    m.to_cols_array()
}

/// Derivative of the stress by finite differences: `[column][row]`, over the nine numbers of F.
fn stress_differences(f: DMat3) -> [[f64; 9]; 9] {
    let step = 1e-6;
    std::array::from_fn(|k| {
        let at = |h: f64| {
            let mut moved = numbers(f);
            moved[k] += h;
            numbers(RUBBER.guarded_energy_and_stress(DMat3::from_cols_array(&moved)).1)
        };
        let (up, down) = (at(step), at(-step));
        std::array::from_fn(|i| (up[i] - down[i]) / (2.0 * step))
    })
}

/// The same from an element's blocks.
fn stress_derivative(f: DMat3, curvature: Curvature) -> [[f64; 9]; 9] {
    let mut all = [[0.0; 9]; 9];
    let blocks = unit_element().stiffness(&RUBBER, nodes_of(f), curvature);
    for (block, (i, j)) in blocks.iter().zip(NODE_PAIRS).filter(|(_, (_, j))| *j > 0) {
        for (r, c) in (0..9).map(|n| (n / 3, n % 3)) {
            let entry = 6.0 * block.col(c)[r];
            all[3 * (j - 1) + c][3 * (i - 1) + r] = entry;
            all[3 * (i - 1) + r][3 * (j - 1) + c] = entry;
        }
    }
    all
}

fn product(a: &[[f64; 9]; 9], b: &[[f64; 9]; 9]) -> [[f64; 9]; 9] {
    std::array::from_fn(|c| std::array::from_fn(|r| (0..9).map(|k| a[k][r] * b[c][k]).sum()))
}

fn rotation(turn: [f64; 3]) -> DMat3 {
    DMat3::from_quat(DQuat::from_scaled_axis(DVec3::from_array(turn)))
}

/// Deformations with stretches from `range`.
fn deformation(range: std::ops::Range<f64>) -> impl Strategy<Value = DMat3> {
    (uniform3(range), uniform3(-3.0..3.0f64), uniform3(-3.0..3.0f64))
        .prop_map(|(s, u, v)| rotation(u) * DMat3::from_diagonal(DVec3::from_array(s)) * rotation(v))
}

#[test]
fn a_bar_follows_the_uniaxial_curve() {
    let (young, poisson) = (1e6, 0.3);
    let bar = Elastic::new(young, poisson).unwrap();
    for stretch in [0.71, 0.9, 1.0, 1.2, 1.6] {
        // Sides without stress: their strain is −ν times that along the bar.
        let side = (1.0 - poisson * (stretch * stretch - 1.0f64)).sqrt();
        let (_, stress) = bar.guarded_energy_and_stress(DMat3::from_diagonal(DVec3::new(stretch, side, side)));
        let expected = young * stretch * (stretch * stretch - 1.0) / 2.0;
        let error = stress - DMat3::from_diagonal(DVec3::X * expected);
        assert!(numbers(error).iter().all(|e| e.abs() < 1e-9 * young), "{stretch}: {stress}");
    }
}

#[test]
fn a_block_follows_the_shear_curves() {
    let Elastic { lambda, mu } = RUBBER;
    for shear in [-1.0f64, -0.2, 0.05, 0.5] {
        let f = DMat3::from_cols(DVec3::X, DVec3::new(shear, 1.0, 0.0), DVec3::Z);
        let (energy, stress) = RUBBER.energy_and_stress::<f64>(&Mat3::constant(f));
        let cubic = lambda / 2.0 + mu;
        let square = shear * shear;
        let expected = DMat3::from_cols(
            DVec3::new(cubic * square, mu * shear, 0.0),
            DVec3::new(mu * shear + cubic * square * shear, cubic * square, 0.0),
            DVec3::Z * (lambda / 2.0 * square),
        );
        assert!(numbers(stress.value() - expected).iter().all(|e| e.abs() < 1e-9), "{shear}");
        let work = mu * square / 2.0 + cubic * square * square / 4.0;
        assert!((energy - work).abs() < 1e-9, "{energy} {work}");
    }
}

proptest! {
    #[test]
    fn stresses_and_stiffness_are_derivatives(f in deformation(0.72..1.8), along in uniform3(uniform3(-1.0..1.0f64))) {
        // The energy by nine dual numbers gives the stress.
        let column = |c: usize| {
            let x = |r: usize| Dual::<9>::variable(f.col(c)[r], 3 * c + r);
            Vec3 { x: x(0), y: x(1), z: x(2) }
        };
        let (energy, _) = RUBBER.energy_and_stress(&Mat3 { columns: [column(0), column(1), column(2)] });
        let (plain, stress) = RUBBER.guarded_energy_and_stress(f);
        prop_assert_eq!(energy.value, plain);
        let automatic = DMat3::from_cols_array(&energy.tangent);
        prop_assert!(numbers(automatic - stress).iter().all(|e| e.abs() < 1e-9 * RUBBER.mu));
        // The stress by one dual number gives the derivative along a direction; so do the blocks, and differences.
        let direction = DMat3::from_cols_array_2d(&along);
        let column = |c: usize| {
            let x = |r: usize| Dual::<1> { value: f.col(c)[r], tangent: [direction.col(c)[r]] };
            Vec3 { x: x(0), y: x(1), z: x(2) }
        };
        let (_, stress) = RUBBER.energy_and_stress(&Mat3 { columns: [column(0), column(1), column(2)] });
        let automatic = stress.columns.map(|v| [v.x.tangent[0], v.y.tangent[0], v.z.tangent[0]]);
        let apply = |k: &[[f64; 9]; 9]| -> [f64; 9] {
            std::array::from_fn(|r| k.iter().zip(numbers(direction)).map(|(column, d)| column[r] * d).sum())
        };
        let (blocks, differences) = (apply(&stress_derivative(f, Curvature::Natural)), apply(&stress_differences(f)));
        for ((a, b), c) in automatic.as_flattened().iter().zip(blocks).zip(differences) {
            prop_assert!((a - b).abs() < 1e-9 * RUBBER.mu, "{a} {b}");
            prop_assert!((a - c).abs() < 1e-4 * RUBBER.mu, "{a} {c}");
        }
    }

    /// Squeezed, flat, inside out: the stress is the derivative of the energy, and the definite derivative is the
    /// positive part P of the derivative H: P H = P P.
    #[test]
    fn the_guarded_energy_has_derivatives_everywhere(f in deformation(-1.0..1.5)) {
        let s = Principal::of(f).stretches;
        // Not on the ridge between two ways back, nor where the strain is held.
        prop_assume!(s.y + s.z > 0.15 && s.z.abs() > 1e-3 && (s - GUARD).abs().min_element() > 1e-4);
        let (_, stress) = RUBBER.guarded_energy_and_stress(f);
        for k in 0..9 {
            let at = |h: f64| {
                let mut moved = numbers(f);
                moved[k] += h;
                RUBBER.guarded_energy_and_stress(DMat3::from_cols_array(&moved)).0
            };
            let slope = (at(1e-6) - at(-1e-6)) / 2e-6;
            prop_assert!((slope - numbers(stress)[k]).abs() < 1e-3 * RUBBER.mu, "{slope} {}", numbers(stress)[k]);
        }
        let (whole, positive) = (stress_differences(f), stress_derivative(f, Curvature::Definite));
        let (a, b) = (product(&positive, &whole), product(&positive, &positive));
        let size = positive.as_flattened().iter().fold(RUBBER.mu, |size, x| size.max(x.abs()));
        for (a, b) in a.as_flattened().iter().zip(b.as_flattened()) {
            prop_assert!((a - b).abs() < 1e-4 * size * size, "{a} {b}");
        }
    }

    /// Where tension holds an element, nothing of its stiffness is negative: both curvatures are one.
    #[test]
    fn under_tension_the_curvature_is_definite(f in deformation(1.01..1.6)) {
        let (natural, definite) = (stress_derivative(f, Curvature::Natural), stress_derivative(f, Curvature::Definite));
        for (a, b) in natural.as_flattened().iter().zip(definite.as_flattened()) {
            prop_assert!((a - b).abs() < 1e-8 * RUBBER.mu, "{a} {b}");
        }
    }

    /// Any element anywhere: internal forces have neither sum nor torque, and definite blocks are.
    #[test]
    fn elements_push_themselves_nowhere(
        corners in uniform4(uniform3(-1.0..1.0f64)),
        places in uniform4(uniform3(-2.0..2.0f64)),
        step in uniform4(uniform3(-1.0..1.0f64)),
    ) {
        let corners = corners.map(DVec3::from_array);
        let Ok(element) = Tetrahedron::new([0, 1, 2, 3], corners) else { return Ok(()) };
        prop_assume!(element.volume() > 0.02);
        let x = places.map(DVec3::from_array);
        let (energy, gradient) = element.energy_and_gradient(&RUBBER, x);
        let size = gradient.iter().map(|g| g.length()).fold(1.0, f64::max);
        let torque: DVec3 = x.iter().zip(gradient).map(|(x, g)| x.cross(g)).sum();
        prop_assert!(energy >= 0.0 && gradient.iter().sum::<DVec3>().length() < 1e-12 * size);
        prop_assert!(torque.length() < 1e-9 * size, "{torque} {size}");
        let step = step.map(DVec3::from_array);
        let (mut work, mut stiffest) = (0.0, 0.0f64);
        for (block, (i, j)) in element.stiffness(&RUBBER, x, Curvature::Definite).iter().zip(NODE_PAIRS) {
            work += if i == j { 1.0 } else { 2.0 } * step[i].dot(*block * step[j]);
            stiffest = numbers(*block).iter().fold(stiffest, |most, k| most.max(k.abs()));
        }
        prop_assert!(work > -1e-9 * stiffest, "{work} {stiffest}");
    }

    #[test]
    fn stretches_put_a_deformation_together_again(
        f in deformation(-2.0..2.0),
        flat in 0..4usize,
        scale in -8..4i32,
        twins in any::<bool>(),
    ) {
        let mut columns = f.to_cols_array_2d().map(DVec3::from_array);
        for column in columns.iter_mut().take(flat) {
            *column = DVec3::ZERO;
        }
        if twins {
            columns[1] = columns[2] * (1.0 + 1e-14);
        }
        let f = DMat3::from_cols(columns[0], columns[1], columns[2]) * 10f64.powi(scale);
        let Principal { u, stretches: s, v } = Principal::of(f);
        let again = u * DMat3::from_diagonal(s) * v.transpose();
        let size = numbers(f).iter().fold(0.0f64, |size, x| size.max(x.abs()));
        prop_assert!(numbers(again - f).iter().all(|e| e.abs() <= 1e-12 * size), "{again} {f}");
        prop_assert!(s.x >= s.y && s.y >= s.z.abs() - 1e-9 * size, "{s}");
        for r in [u, v] {
            prop_assert!((r.determinant() - 1.0).abs() < 1e-12);
            prop_assert!(numbers(r.transpose() * r - DMat3::IDENTITY).iter().all(|e| e.abs() < 1e-12));
        }
    }

    /// However an element is stretched otherwise, one that is flat or inside out is pushed back.
    #[test]
    fn what_is_inside_out_is_pushed_back(a in 0.0..20.0f64, b in 0.0..20.0f64, c in -5.0..0.0f64, poisson in 0.0..0.49f64) {
        let material = Elastic::new(1e6, poisson).unwrap();
        let stretched = Stretched::new(&material, DVec3::new(a.max(-c), b.max(-c), c));
        prop_assert!(stretched.stresses().z < -0.5 * material.mu);
    }
}

#[test]
fn nothing_jumps_at_the_guard() {
    for side in [0.8, 1.0, 1.3] {
        let at = |s: f64| {
            let f = DMat3::from_diagonal(DVec3::new(s, side, 1.0));
            let (energy, stress) = RUBBER.guarded_energy_and_stress(f);
            (energy, stress, stress_derivative(f, Curvature::Definite))
        };
        let (above, below) = (at(GUARD + 1e-9), at(GUARD - 1e-9));
        assert!((above.0 - below.0).abs() < 1e-3 && numbers(above.1 - below.1).iter().all(|e| e.abs() < 1e-2));
        for (a, b) in above.2.as_flattened().iter().zip(below.2.as_flattened()) {
            assert!((a - b).abs() < 1e-2, "{a} {b}");
        }
    }
}

/// The law of the talk gives way at 1/√3; ours resists more and more, for any Poisson ratio.
#[test]
fn pressure_keeps_stiffening() {
    for poisson in [0.0, 0.3, 0.45, 0.49] {
        let material = Elastic::new(1e6, poisson).unwrap();
        let squeezes: [&dyn Fn(f64) -> DVec3; 3] =
            [&|s| DVec3::new(1.0, 1.0, s), &|s| DVec3::new(1.0, s, s), &|s| DVec3::splat(s)];
        for (axes, squeeze) in (1..).zip(squeezes) {
            // A body squeezed from all sides is not turned inside out by it.
            let least = if axes == 1 { -100 } else { 1 };
            let pressures: Vec<f64> = (least..=70)
                .map(|percent| -Stretched::new(&material, squeeze(f64::from(percent) / 100.0)).stresses().z)
                .collect();
            let stiffening = pressures.windows(3).all(|p| p[0] - p[1] >= p[1] - p[2]);
            assert!(pressures.windows(2).all(|p| p[0] > p[1]), "gives way at {poisson} along {axes} axes");
            assert!(stiffening, "softens at {poisson} along {axes} axes");
        }
    }
}

#[test]
fn bad_materials_and_elements_are_refused_by_name() {
    assert!(Elastic::new(0.0, 0.3).unwrap_err().to_string().contains("young is 0"));
    assert!(Elastic::new(f64::NAN, 0.3).unwrap_err().to_string().contains("young is NaN"));
    assert!(Elastic::new(1e6, 0.5).unwrap_err().to_string().contains("poisson is 0.5"));
    let refused = |corners| Tetrahedron::new([0, 1, 2, 3], corners).unwrap_err().to_string();
    assert!(refused([DVec3::ZERO, DVec3::Y, DVec3::X, DVec3::Z]).contains("inside out"));
    assert!(refused([DVec3::ZERO, DVec3::X, DVec3::Y, DVec3::ONE - DVec3::Z]).contains("flat"));
    assert!(refused([DVec3::NAN, DVec3::X, DVec3::Y, DVec3::Z]).contains("flat"));
    assert_eq!(Elastic::new(2.6e6, 0.3).unwrap().mu, 1e6);
}

/// A mesh whose nodes were thrown about at random, half of its elements inside out, finds back by implicit steps.
#[test]
fn a_crushed_mesh_recovers() {
    let mesh = TetrahedralMesh::of_box(DVec3::ZERO, DVec3::new(0.6, 0.4, 0.4), [3, 2, 2]).unwrap();
    let element = |e: usize| Tetrahedron::new(mesh.elements()[e], mesh.corners(e)).unwrap();
    let elements: Vec<_> = (0..mesh.elements().len()).map(element).collect();
    // Any fixed scatter will do.
    let scatter = |i: usize| DVec3::new((i as f64 * 7.1).sin(), (i as f64 * 3.7).cos(), (i as f64 * 5.3).sin());
    let mut x: Vec<DVec3> = mesh.nodes().iter().enumerate().map(|(i, &p)| p + scatter(i) * 0.25).collect();
    let inverted = |x: &[DVec3]| {
        let at = |e: &&Tetrahedron| e.deformation(e.nodes.map(|n| x[n as usize])).determinant() < 0.0;
        elements.iter().filter(at).count()
    };
    assert!(inverted(&x) > elements.len() / 4, "{} of {}", inverted(&x), elements.len());
    let mut v = vec![DVec3::ZERO; x.len()];
    for _ in 0..60 {
        implicit_step(&elements, &mut x, &mut v);
    }
    assert_eq!(inverted(&x), 0);
    // At rest in its own shape, wherever it went: every edge has its length.
    for e in &elements {
        let strain = green_strain::<f64>(&Mat3::constant(e.deformation(e.nodes.map(|n| x[n as usize])))).value();
        assert!(numbers(strain).iter().all(|d| d.abs() < 0.01), "{strain}");
    }
}

/// One step of 1/30 s of implicit Euler by Newton and conjugate gradients, 1 kg a node.
fn implicit_step(elements: &[Tetrahedron], x: &mut [DVec3], v: &mut [DVec3]) {
    let inertia = 900.0;
    let start = x.to_vec();
    let target: Vec<DVec3> = x.iter().zip(v.iter()).map(|(x, v)| x + v / 30.0).collect();
    let evaluate = |x: &[DVec3]| {
        let mut gradient: Vec<DVec3> = x.iter().zip(&target).map(|(x, t)| (x - t) * inertia).collect();
        let mut energy = gradient.iter().map(|g| g.length_squared() / (2.0 * inertia)).sum::<f64>();
        for e in elements {
            let (own, push) = e.energy_and_gradient(&RUBBER, e.nodes.map(|n| x[n as usize]));
            energy += own;
            e.nodes.iter().zip(push).for_each(|(&n, g)| gradient[n as usize] += g);
        }
        (energy, gradient)
    };
    for _ in 0..40 {
        let (energy, gradient) = evaluate(x);
        if gradient.iter().all(|g| g.length() < 1e-2) {
            break;
        }
        let blocks: Vec<NodeBlocks> = elements
            .iter()
            .map(|e| e.stiffness(&RUBBER, e.nodes.map(|n| x[n as usize]), Curvature::Definite))
            .collect();
        let apply = |p: &[DVec3]| {
            let mut image: Vec<DVec3> = p.iter().map(|p| p * inertia).collect();
            for (e, blocks) in elements.iter().zip(&blocks) {
                for (block, (i, j)) in blocks.iter().zip(NODE_PAIRS) {
                    let (i_, j_) = (e.nodes[i] as usize, e.nodes[j] as usize);
                    image[i_] += *block * p[j_];
                    if i != j {
                        image[j_] += block.transpose() * p[i_];
                    }
                }
            }
            image
        };
        let step = conjugate_gradients(apply, &gradient);
        let mut share = 1.0;
        while share > 1e-6 {
            let candidate: Vec<DVec3> = x.iter().zip(&step).map(|(x, s)| x - s * share).collect();
            if evaluate(&candidate).0 < energy {
                x.copy_from_slice(&candidate);
                break;
            }
            share /= 2.0;
        }
    }
    v.iter_mut().zip(x.iter().zip(start)).for_each(|(v, (x, start))| *v = (x - start) * 30.0);
}

fn conjugate_gradients(apply: impl Fn(&[DVec3]) -> Vec<DVec3>, b: &[DVec3]) -> Vec<DVec3> {
    let dot = |a: &[DVec3], b: &[DVec3]| a.iter().zip(b).map(|(a, b)| a.dot(*b)).sum::<f64>();
    let (mut x, mut r, mut p) = (vec![DVec3::ZERO; b.len()], b.to_vec(), b.to_vec());
    let (first, mut rr) = (dot(b, b), dot(b, b));
    for _ in 0..500 {
        if rr <= 1e-16 * first {
            break;
        }
        let image = apply(&p);
        let a = rr / dot(&p, &image);
        x.iter_mut().zip(&p).for_each(|(x, p)| *x += p * a);
        r.iter_mut().zip(&image).for_each(|(r, i)| *r -= i * a);
        let next = dot(&r, &r);
        p.iter_mut().zip(&r).for_each(|(p, r)| *p = r + *p * (next / rr));
        rr = next;
    }
    x
}
