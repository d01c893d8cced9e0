//! Materials of an arena file: `[materials.NAME]`, and `[[material_pairs]]` for contacts that go their own way.

use std::collections::BTreeMap;

use pita_sim::{Material, MaterialId, Surface};
use serde::Deserialize;

use super::{ArenaError, Key};

/// Most materials of an arena.
const MATERIALS_MAX: usize = 1_024;

/// Most pairs of materials that go their own way.
const PAIRS_MAX: usize = 4_096;

/// Materials that are there without a table, made of the vehicle's own keys; in the order of their ids, the first of which
/// is of what has no name.
const BUILT_IN: [&str; 3] = ["", "chassis", "tyre"];

/// What a surface, or a contact of two, is like.
#[derive(Clone, Copy, Debug, Default, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct MaterialFile {
    /// Coulomb coefficient.
    pub friction: f64,
    /// Speed after a collision over speed before.
    #[serde(default)]
    pub restitution: f64,
    /// Lever of the normal force against rolling, m.
    #[serde(default)]
    pub rolling_resistance: f64,
    /// Lever of the normal force against spinning about the normal, m.
    #[serde(default)]
    pub spinning_resistance: f64,
}

impl MaterialFile {
    fn check(&self, key: &Key) -> Result<(), ArenaError> {
        key.at("friction").number(self.friction, 0.0, 5.0, "")?;
        key.at("restitution").number(self.restitution, 0.0, 1.0, "")?;
        key.at("rolling_resistance").number(self.rolling_resistance, 0.0, 1.0, "m")?;
        key.at("spinning_resistance").number(self.spinning_resistance, 0.0, 1.0, "m")
    }
}

impl From<MaterialFile> for Surface {
    fn from(file: MaterialFile) -> Self {
        let MaterialFile { friction, restitution, rolling_resistance, spinning_resistance } = file;
        Self { friction, restitution, rolling_resistance, spinning_resistance }
    }
}

/// Two materials whose contact is not as the rule says.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct MaterialPairFile {
    /// Names of both.
    pub between: [String; 2],
    /// What their contact is like.
    pub contact: MaterialFile,
}

/// The names of an arena's materials and what is known by them.
#[derive(Clone, Debug)]
pub struct Materials {
    /// By id.
    names: Vec<String>,
    by_name: BTreeMap<String, Material>,
}

impl Materials {
    /// The materials of a file's table.
    pub fn new(table: &BTreeMap<String, MaterialFile>) -> Self {
        let names: Vec<String> = BUILT_IN.iter().map(|&name| name.to_owned()).chain(table.keys().cloned()).collect();
        let ids = (BUILT_IN.len() as u16..).map(MaterialId);
        let materials = table.iter().zip(ids).map(|((name, &file), id)| {
            let surface = Surface::from(file);
            (name.clone(), Material { id, surface })
        });
        Self { by_name: materials.collect(), names }
    }

    /// A material of the file.
    pub fn get(&self, name: &str) -> Option<&Material> {
        self.by_name.get(name)
    }

    /// What a material is called: as in the file, `chassis` or `tyre`; empty where it has no name.
    pub fn name(&self, id: MaterialId) -> &str {
        self.names.get(usize::from(id.0)).map_or("", String::as_str)
    }

    /// Id of a name.
    pub fn id(&self, name: &str) -> Option<MaterialId> {
        let place = self.names.iter().position(|known| known == name)?;
        u16::try_from(place).ok().map(MaterialId)
    }
}

/// Material of a vehicle's body.
pub(crate) fn chassis(friction: f64) -> Material {
    Material { id: MaterialId(1), ..Material::from(friction) }
}

/// Material of a vehicle's wheels.
pub(crate) fn tyre(friction: f64) -> Material {
    Material { id: MaterialId(2), ..Material::from(friction) }
}

/// # Errors
/// [`ArenaError::OutOfRange`] for the first name or number that is not allowed.
pub(super) fn check(table: &BTreeMap<String, MaterialFile>, pairs: &[MaterialPairFile]) -> Result<(), ArenaError> {
    let key = Key::new("materials");
    key.count(table.len(), 0, MATERIALS_MAX, "materials")?;
    for (name, material) in table {
        let is_free = !BUILT_IN.contains(&name.as_str());
        key.require(is_free, format_args!("{name:?}"), "a name other than chassis and tyre, which vehicles have")?;
        material.check(&key.at(name))?;
    }
    let key = Key::new("material_pairs");
    key.count(pairs.len(), 0, PAIRS_MAX, "entries")?;
    let materials = Materials::new(table);
    let allowed = super::checks::one_of("materials", materials.names[1..].iter());
    let mut seen = std::collections::BTreeSet::new();
    for (i, pair) in pairs.iter().enumerate() {
        let key = key.index(i);
        for (side, name) in pair.between.iter().enumerate() {
            let is_known = !name.is_empty() && materials.id(name).is_some();
            key.at("between").index(side).require(is_known, name, &allowed)?;
        }
        let [a, b] = &pair.between;
        let is_new = seen.insert([a.min(b), a.max(b)]);
        key.at("between").require(is_new, format_args!("{a}, {b}"), "a pair that has no entry yet")?;
        pair.contact.check(&key.at("contact"))?;
    }
    Ok(())
}
