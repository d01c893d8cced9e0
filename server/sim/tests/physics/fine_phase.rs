//! The fine phase against the slow reference; a million pairs are `cargo run --example gjk_reference`.

use pairs::{Kind, Pairs};
use pita_sim::collide::{At, proximity};
use pita_sim::{Collider, DQuat, DVec3, Shape};
use tally::Tally;

#[path = "../../examples/gjk_reference/pairs.rs"]
mod pairs;
#[path = "../../examples/gjk_reference/reference.rs"]
mod reference;
#[path = "../../examples/gjk_reference/tally.rs"]
mod tally;

/// Random and degenerate pairs: distance within a micrometre, depth too, never a NaN, and nothing missed.
#[test]
fn distances_and_depths_are_those_of_the_reference() {
    for kind in Kind::ALL {
        let (mut pairs, mut tally) = (Pairs::new(20), Tally::of(kind));
        for _ in 0..125 {
            let pair = pairs.pair(kind);
            assert!(tally.check(&pair), "{tally:?}: {pair:?}");
        }
        assert!(tally.unsure <= 3, "{tally:?}");
    }
}

/// A corner and an edge half a nanometre apart: GJK takes them for overlapping, and EPA, which then begins with a line
/// through the origin, loses the face that the origin is on. It finds the next one, 0.56 m away.
#[test]
fn what_but_touches_is_not_half_a_metre_deep() {
    let points = [
        DVec3::new(0.6558822069460088, 0.7838199475000907, -0.6056880047451924),
        DVec3::new(-0.6408691369355172, -0.7188198526642595, 0.384773357895694),
        DVec3::new(0.06230293867387504, 0.013914031799027171, 0.7425580498486419),
        DVec3::new(-0.26407721640789106, 0.44313826245703725, 0.6100205411504036),
    ];
    let half = DVec3::new(0.11419756875581025, 0.7412827301489597, 0.08966918091745096);
    let hull = Collider::new(Shape::Hull { points: points.to_vec(), radius: 0.0 }, 0.5);
    let block = Collider::new(Shape::Box { half }, 0.5);
    let hull = At {
        collider: &hull,
        position: DVec3::new(86.32579584887287, 99.27018998681487, 12.035518021312713),
        rotation: DQuat::from_xyzw(-0.6602221043210318, -0.5924893448917088, -0.2765953603044661, -0.3695377596589354),
    };
    let block = At {
        collider: &block,
        position: DVec3::new(86.39284786386978, 99.55254982743308, 13.15289952547576),
        rotation: DQuat::from_xyzw(-0.4341237456814308, 0.4350211173451053, 0.4565540493006485, -0.6433129883396739),
    };
    let found = proximity(hull, block, 0.1).unwrap();
    assert!(found.gap.abs() < 1e-6, "{found:?}");
}
