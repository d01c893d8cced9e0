//! Kinds of actors that an arena file can place: `[[actors]]`, `kind = "crate"`.
//!
//! Owns the list of kinds and what becomes of such a table: its common keys are the arena file's, the rest are the
//! parameters of the kind, read and checked before anything is built. Other crates add kinds of their own to the list,
//! [`ActorKinds::with`].

use std::collections::BTreeMap;

use pita_sim::{Material, SimError, World};
use serde::de::DeserializeOwned;

use crate::actor::{Actor, ActorInfo};
use crate::arena_file::{ActorFile, ArenaError, ArenaFile, Key, Materials};
use crate::part::PartInfo;
use crate::prop::{Barrel, Crate, Drawbridge, Fence, Jelly, Prop, Seesaw};
use crate::sheep::Sheep;
use crate::spawn::Pose;
use crate::tornado::Tornado;

/// An actor that arena files can place.
pub trait ActorKind: Actor + Sized + 'static {
    /// What files call it: `kind = "crate"`; its [`ActorInfo::kind`] as well.
    const KIND: &'static str;

    /// The kind's own keys; `#[serde(deny_unknown_fields)]` makes a misspelt key an error.
    type Parameters: DeserializeOwned + Send + 'static;

    /// Whether the parameters are in range, and what they name exists; `key` is the path of the table in the file.
    ///
    /// # Errors
    /// [`ArenaError::OutOfRange`] for the first value that is not allowed.
    fn check(parameters: &Self::Parameters, key: &Key, file: &ArenaFile) -> Result<(), ArenaError>;

    /// Adds one to the world.
    ///
    /// # Errors
    /// What the engine refuses; the bodies that were added before are taken out again.
    fn add(site: &mut Site, parameters: &Self::Parameters) -> Result<Self, SimError>;
}

/// Where an actor of an arena file is built.
pub struct Site<'a> {
    /// For its bodies and what holds them together.
    pub world: &'a mut World,
    /// [`ActorInfo::id`].
    pub id: u32,
    /// [`ActorInfo::name`].
    pub name: &'a str,
    /// The place that the file gives it.
    pub pose: Pose,
    /// The whole file, for routes and bounds.
    pub file: &'a ArenaFile,
    /// The file's materials.
    pub materials: &'a Materials,
}

impl Site<'_> {
    /// A material by its name, which [`ArenaFile::check_material`] has found to exist.
    pub fn material(&self, name: &str) -> Material {
        self.materials.get(name).copied().unwrap_or_default()
    }

    /// The description of the actor that is built here.
    pub fn info(&self, kind: &'static str, parts: Vec<PartInfo>) -> ActorInfo {
        ActorInfo { id: self.id, kind, name: self.name.to_owned(), slot: None, parts }
    }
}

/// Adds an actor of a table that was read and checked.
pub(crate) type Recipe = Box<dyn Fn(&mut Site) -> Result<Box<dyn Actor>, SimError> + Send>;

type Read = fn(toml::Table, &Key, &ArenaFile) -> Result<Recipe, ArenaError>;

/// The kinds that a file may name.
#[derive(Clone, Debug, Default)]
pub struct ActorKinds(BTreeMap<&'static str, Read>);

impl ActorKinds {
    /// No kinds at all.
    pub fn none() -> Self {
        Self::default()
    }

    /// The kinds that come with the game.
    pub fn built_in() -> Self {
        let loose = Self::none().with::<Prop>().with::<Crate>().with::<Barrel>();
        let held = loose.with::<Fence>().with::<Seesaw>().with::<Drawbridge>().with::<Jelly>();
        held.with::<Sheep>().with::<Tornado>()
    }

    /// These kinds and `K`, which takes the place of one that has its name.
    pub fn with<K: ActorKind>(mut self) -> Self {
        self.0.insert(K::KIND, read::<K>);
        self
    }

    /// Names of the kinds, in order.
    pub fn names(&self) -> impl Iterator<Item = &'static str> + '_ {
        self.0.keys().copied()
    }

    /// What the `index`-th table of `file` is built by.
    pub(crate) fn recipe(&self, index: usize, actor: &ActorFile, file: &ArenaFile) -> Result<Recipe, ArenaError> {
        let key = Key::new("actors").index(index);
        let Some(read) = self.0.get(actor.kind.as_str()) else {
            let known: Vec<_> = self.names().collect();
            return Err(key.at("kind").refuse(&actor.kind, &format!("one of {}", known.join(", "))));
        };
        read(actor.parameters.clone(), &key, file)
    }
}

fn read<K: ActorKind>(table: toml::Table, key: &Key, file: &ArenaFile) -> Result<Recipe, ArenaError> {
    let wrong = |error: toml::de::Error| ArenaError::Parameters {
        key: key.to_string(),
        kind: K::KIND,
        message: error.to_string().trim().replace('\n', " "),
    };
    let parameters: K::Parameters = table.try_into().map_err(wrong)?;
    K::check(&parameters, key, file)?;
    Ok(Box::new(move |site| Ok(Box::new(K::add(site, &parameters)?))))
}
