//! Pools: the potentials of one type, with those that take part apart from those between sleepers.

use std::ops::{Deref, DerefMut};

use slotmap::{Key, SlotMap};

/// Potentials of one type under generational handles.
#[derive(Clone, Debug)]
pub(crate) struct Pool<K: Key, V> {
    all: SlotMap<K, V>,
    /// Those that may take part in a tick; some may be gone.
    awake: Vec<K>,
}

impl<K: Key, V> Default for Pool<K, V> {
    fn default() -> Self {
        Self { all: SlotMap::with_key(), awake: Vec::new() }
    }
}

impl<K: Key, V> Pool<K, V> {
    /// Adds a potential that takes part.
    pub fn insert(&mut self, value: V) -> K {
        let key = self.all.insert(value);
        self.awake.push(key);
        key
    }

    /// Removes a potential.
    pub fn remove(&mut self, key: K) -> Option<V> {
        self.awake.retain(|&other| other != key);
        self.all.remove(key)
    }

    /// Those that take part, in a stable order.
    pub fn awake(&self) -> impl Iterator<Item = (K, &V)> {
        self.awake.iter().filter_map(|&key| Some((key, self.all.get(key)?)))
    }

    /// From now on those take part of which `is_awake` says so.
    pub fn sort(&mut self, is_awake: impl Fn(&V) -> bool) {
        self.awake.clear();
        self.awake.extend(self.all.iter().filter(|(_, value)| is_awake(value)).map(|(key, _)| key));
    }
}

impl<K: Key, V> Deref for Pool<K, V> {
    type Target = SlotMap<K, V>;

    fn deref(&self) -> &Self::Target {
        &self.all
    }
}

impl<K: Key, V> DerefMut for Pool<K, V> {
    fn deref_mut(&mut self) -> &mut Self::Target {
        &mut self.all
    }
}
