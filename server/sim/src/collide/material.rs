//! Materials: what the surface of a collider is like, and what becomes of two that touch.
//!
//! Owns the combination rule and the table of pairs that go their own way. It knows nothing of shapes and bodies.

use std::collections::BTreeMap;

use crate::error::{SimError, require};

/// Names a material in the table of pairs, and to game logic. The engine gives it no other meaning.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord)]
pub struct MaterialId(pub u16);

/// Coefficients of a surface, or of a contact between two.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Surface {
    /// Coulomb coefficient, 0 to 10.
    pub friction: f64,
    /// Speed after a collision over speed before, 0 to 1.
    pub restitution: f64,
    /// Lever of the normal force against rolling, m, 0 to 10: a ball of radius r that rolls freely on a plane slows down
    /// by 5/7 g times this over r.
    pub rolling_resistance: f64,
    /// Lever of the normal force against spinning about the normal, m, 0 to 10.
    pub spinning_resistance: f64,
}

impl Surface {
    /// A contact's coefficients where the table says nothing: friction is the geometric mean, so that one slippery side
    /// is enough to slip; the others are the larger ones, so that one bouncy or soft side is enough.
    pub fn combined(a: &Self, b: &Self) -> Self {
        Self {
            friction: (a.friction * b.friction).sqrt(),
            restitution: a.restitution.max(b.restitution),
            rolling_resistance: a.rolling_resistance.max(b.rolling_resistance),
            spinning_resistance: a.spinning_resistance.max(b.spinning_resistance),
        }
    }

    /// # Errors
    /// [`SimError::OutOfRange`] for the first coefficient that is.
    pub fn validate(&self) -> Result<(), SimError> {
        let Self { friction, restitution, rolling_resistance, spinning_resistance } = *self;
        require((0.0..=10.0).contains(&friction), "friction", friction, "0 to 10")?;
        require((0.0..=1.0).contains(&restitution), "restitution", restitution, "0 to 1")?;
        let levers = [("rolling_resistance", rolling_resistance), ("spinning_resistance", spinning_resistance)];
        levers.into_iter().try_for_each(|(what, b)| require((0.0..=10.0).contains(&b), what, b, "0 to 10 m"))
    }
}

/// What a collider is made of.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Material {
    /// Its name.
    pub id: MaterialId,
    /// Its coefficients against a material with which it has no entry in the table.
    pub surface: Surface,
}

/// A material with this coefficient of friction and nothing else.
impl From<f64> for Material {
    fn from(friction: f64) -> Self {
        Self { id: MaterialId::default(), surface: Surface { friction, ..Surface::default() } }
    }
}

/// Pairs of materials whose contacts are not as the rule says.
#[derive(Clone, Debug, Default)]
pub(crate) struct MaterialTable {
    /// By names, the smaller first.
    pairs: BTreeMap<[MaterialId; 2], Surface>,
}

impl MaterialTable {
    /// From now on contacts of `a` with `b` are like `surface`.
    pub fn insert(&mut self, a: MaterialId, b: MaterialId, surface: Surface) {
        self.pairs.insert([a.min(b), a.max(b)], surface);
    }

    /// What a contact of `a` with `b` is like.
    pub fn contact(&self, a: &Material, b: &Material) -> Surface {
        let entry = if self.pairs.is_empty() { None } else { self.pairs.get(&[a.id.min(b.id), a.id.max(b.id)]) };
        entry.copied().unwrap_or_else(|| Surface::combined(&a.surface, &b.surface))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_pair_in_the_table_is_as_the_table_says_whoever_comes_first() {
        let material = |id, friction| Material { id: MaterialId(id), ..Material::from(friction) };
        let (ice, rubber) = (material(1, 0.04), material(2, 1.0));
        let mut table = MaterialTable::default();
        assert!((table.contact(&ice, &rubber).friction - 0.2).abs() < 1e-12);
        table.insert(rubber.id, ice.id, Surface { friction: 0.15, restitution: 0.3, ..Surface::default() });
        for pair in [table.contact(&ice, &rubber), table.contact(&rubber, &ice)] {
            assert_eq!((pair.friction, pair.restitution), (0.15, 0.3));
        }
        assert_eq!(table.contact(&rubber, &rubber).friction, 1.0);
    }

    #[test]
    fn one_bouncy_side_is_enough() {
        let (a, b) = (Surface { restitution: 0.8, ..Surface::default() }, Surface::default());
        assert_eq!(Surface::combined(&a, &b).restitution, 0.8);
    }

    #[test]
    fn coefficients_out_of_range_are_named() {
        for (surface, what) in [
            (Surface { friction: -0.1, ..Surface::default() }, "friction is -0.1"),
            (Surface { restitution: 1.5, ..Surface::default() }, "restitution is 1.5"),
            (Surface { rolling_resistance: f64::NAN, ..Surface::default() }, "rolling_resistance is NaN"),
            (Surface { spinning_resistance: 11.0, ..Surface::default() }, "spinning_resistance is 11"),
        ] {
            assert!(surface.validate().unwrap_err().to_string().contains(what), "{what}");
        }
    }
}
