//! The fine phase against the slow reference; a million pairs are `cargo run --example gjk_reference`.

use pairs::{Kind, Pairs};
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
