//! The global state: Q and Q' as flat arrays, cut into slices.
//!
//! A slice is a body's share of both. Freed shares are used again by the next body of the same size, so the arrays
//! never move a living slice.

use std::ops::Range;

/// Where a body's DOF lie in Q and in Q'.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Slice {
    q_start: u32,
    v_start: u32,
    q_len: u32,
    v_len: u32,
}

impl Slice {
    fn q(self) -> Range<usize> {
        self.q_start as usize..(self.q_start + self.q_len) as usize
    }

    fn v(self) -> Range<usize> {
        self.v_start as usize..(self.v_start + self.v_len) as usize
    }
}

/// Q and Q' of everything that moves.
#[derive(Clone, Debug, Default)]
pub(crate) struct State {
    /// Generalised positions.
    q: Vec<f64>,
    /// Their rates. A unit quaternion's rate is an angular velocity, so a slice of Q' can be shorter than that of Q.
    v: Vec<f64>,
    free: Vec<Slice>,
}

impl State {
    /// A zeroed slice of `q_len` positions and `v_len` rates.
    pub fn allocate(&mut self, q_len: u32, v_len: u32) -> Slice {
        if let Some(i) = self.free.iter().position(|s| (s.q_len, s.v_len) == (q_len, v_len)) {
            return self.free.swap_remove(i);
        }
        let (q_start, v_start) = (self.q.len() as u32, self.v.len() as u32);
        self.q.resize(self.q.len() + q_len as usize, 0.0);
        self.v.resize(self.v.len() + v_len as usize, 0.0);
        Slice { q_start, v_start, q_len, v_len }
    }

    /// Gives a slice back.
    pub fn free(&mut self, slice: Slice) {
        self.q_mut(slice).fill(0.0);
        self.v_mut(slice).fill(0.0);
        self.free.push(slice);
    }

    /// Positions of `slice`.
    pub fn q(&self, slice: Slice) -> &[f64] {
        &self.q[slice.q()]
    }

    /// Rates of `slice`.
    pub fn v(&self, slice: Slice) -> &[f64] {
        &self.v[slice.v()]
    }

    /// Positions of `slice`.
    pub fn q_mut(&mut self, slice: Slice) -> &mut [f64] {
        &mut self.q[slice.q()]
    }

    /// Rates of `slice`.
    pub fn v_mut(&mut self, slice: Slice) -> &mut [f64] {
        &mut self.v[slice.v()]
    }

    /// Hash over every bit of Q and Q' (XXH3, 64 bits).
    pub fn hash(&self) -> u64 {
        let mut hasher = xxhash_rust::xxh3::Xxh3::new();
        for x in self.q.iter().chain(&self.v) {
            hasher.update(&x.to_le_bytes());
        }
        hasher.digest()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_freed_slice_is_zeroed_and_used_again() {
        let mut state = State::default();
        let a = state.allocate(7, 6);
        let b = state.allocate(3, 3);
        state.q_mut(a).fill(1.0);
        state.q_mut(b).fill(2.0);
        state.free(a);
        let c = state.allocate(7, 6);
        assert_eq!(a, c);
        assert_eq!(state.q(c), [0.0; 7]);
        assert_eq!(state.q(b), [2.0; 3]);
    }

    #[test]
    fn one_bit_changes_the_hash() {
        let mut state = State::default();
        let a = state.allocate(3, 3);
        let before = state.hash();
        state.v_mut(a)[2] = -0.0;
        assert_ne!(before, state.hash());
    }
}
