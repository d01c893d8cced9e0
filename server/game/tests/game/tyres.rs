//! What a tyre gives, along its heading and across it, as `docs/VEHICLE.md` has it: the contact model measured on a wheel
//! of the default car.

use pita_sim::DVec3;

use rig::{Rig, SPEED};

#[path = "../../examples/tyre_curves/rig.rs"]
mod rig;

#[test]
fn a_tyre_gives_coulombs_force_at_any_slip() {
    for tick_hz in [30.0, 480.0] {
        eprintln!("{tick_hz} Hz");
        for slip in [0.0, 0.001, 0.002, 0.005, 0.01, 0.02, 0.05, 0.1, 0.3, 1.0] {
            let (along, across) = (Rig::new(tick_hz).along(slip), Rig::new(tick_hz).across(slip));
            eprintln!(
                "slip {slip}: along {:.3} {:.3}, across at {:.2} deg {:.3} {:.3}",
                along[0],
                along[1],
                f64::atan(slip).to_degrees(),
                across[0],
                across[1]
            );
            if slip >= 0.01 {
                assert!((along[0] + 1.0).abs() < 0.03 && along[1].abs() < 0.01, "slip {slip}: {along:?}");
                assert!((across[1] + 1.0).abs() < 0.03 && across[0].abs() < 0.1, "slip {slip}: {across:?}");
            }
        }
    }
}

/// Sliding both ways the force points against the slip and stays within the circle.
#[test]
fn slip_along_and_across_share_one_circle() {
    let [along, across] = Rig::new(30.0).force(DVec3::new(SPEED, 0.0, 1.0), SPEED - 1.0);
    assert!((along.hypot(across) - 1.0).abs() < 0.03, "{along} {across}");
    assert!((along / across - 1.0).abs() < 0.05, "{along} {across}");
}
