//! Groups and masks: which colliders look at each other at all.

/// Groups of a collider, as bits, and the groups that it collides with. Two colliders meet where each is in a group that
/// the other collides with.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Groups {
    /// Groups that it is in.
    pub memberships: u32,
    /// Groups that it collides with.
    pub mask: u32,
}

impl Groups {
    /// In every group, and collides with all of them.
    pub const ALL: Self = Self { memberships: u32::MAX, mask: u32::MAX };

    /// Whether two colliders meet.
    pub fn meet(self, other: Self) -> bool {
        self.memberships & other.mask != 0 && other.memberships & self.mask != 0
    }
}

impl Default for Groups {
    fn default() -> Self {
        Self::ALL
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn both_sides_must_want_to_meet() {
        let ghost = Groups { memberships: 2, mask: 1 };
        let wall = Groups { memberships: 1, mask: u32::MAX };
        assert!(ghost.meet(wall) && wall.meet(ghost));
        assert!(!ghost.meet(ghost));
        assert!(!wall.meet(Groups { memberships: u32::MAX, mask: 2 }));
        assert!(Groups::ALL.meet(ghost));
    }
}
