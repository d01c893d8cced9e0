//! Who is in the world, for those who choose whom to send: bodies that belong together, where they are, what they matter.
//!
//! Made once a tick from a frame, in the order of the state that is coded; cells and own actors are made of it.

/// Bodies of an actor that are sent together; a body of no actor is a family of its own.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Family {
    /// Id of its first body.
    pub root: u32,
    /// Where that is, m; nowhere for a game's own kinds, whose numbers may be anything.
    pub position: Option<[f32; 3]>,
    /// How fast, m/s.
    pub speed: f32,
    /// Factor that the actor sets: [`Actor::relevance`](pita_game::Actor::relevance).
    pub importance: f32,
    /// Slot of the session that drives it.
    pub slot: Option<u16>,
}

/// All families.
#[derive(Clone, Debug, Default)]
pub struct Crowd {
    families: Vec<Family>,
    /// Of each body of the state, in order.
    of_body: Vec<u32>,
}

impl Crowd {
    /// Forgets everybody, and keeps the memory.
    pub fn clear(&mut self) {
        self.families.clear();
        self.of_body.clear();
    }

    /// The next body of the state is the first of `family`. Roots ascend.
    pub fn add_root(&mut self, family: Family) {
        self.of_body.push(self.families.len() as u32);
        self.families.push(family);
    }

    /// The next body of the state belongs to the family of `root`. `false` where there is none yet.
    pub fn add_member(&mut self, root: u32) -> bool {
        let found = self.families.binary_search_by_key(&root, |family| family.root);
        self.of_body.extend(found.ok().map(|at| at as u32));
        found.is_ok()
    }

    /// In order of root.
    pub fn families(&self) -> &[Family] {
        &self.families
    }

    /// Index of each body's family, in the order of the state's bodies.
    pub fn of_bodies(&self) -> &[u32] {
        &self.of_body
    }
}
