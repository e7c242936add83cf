//! Fingerprints of state: equal hashes mean equal states.

use crate::model::body::Body;
use crate::model::contact::Contact;
use crate::model::id::{GlobalId, TileId};
use bytemuck::{Pod, Zeroable};
use std::fmt;
use xxhash_rust::xxh3::xxh3_128;

#[cfg(test)]
mod tests;

/// Two sums modulo 2^128 of xxh3-128 hashes, one per body and one per contact copy held; sums do not depend on order,
/// so neither on ranks. Equal both, equal futures.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub struct Hashes {
    /// Over id, position, rotation and velocities of every owned body.
    pub state: u128,
    /// Over pair, tile, features, impulses and manifold of every contact every tile holds.
    pub contact: u128,
}

impl Hashes {
    /// The hashes of two disjoint parts of a world, joined.
    #[must_use]
    pub fn merge(self, other: Self) -> Self {
        Self { state: self.state.wrapping_add(other.state), contact: self.contact.wrapping_add(other.contact) }
    }

    /// As words, for plain old data: the low and the high half of the state's, then of the contacts'.
    pub fn to_words(self) -> [u64; 4] {
        let [state, contact] = [self.state, self.contact].map(|hash| [hash as u64, (hash >> 64) as u64]);
        [state[0], state[1], contact[0], contact[1]]
    }

    /// From [words](Self::to_words).
    pub fn from_words([state, state_high, contact, contact_high]: [u64; 4]) -> Self {
        let join = |low: u64, high: u64| u128::from(low) | u128::from(high) << 64;
        Self { state: join(state, state_high), contact: join(contact, contact_high) }
    }

    pub(crate) fn add_body(&mut self, body: &Body) {
        #[derive(Clone, Copy, Pod, Zeroable)]
        #[repr(C)]
        struct Key {
            id: GlobalId,
            position: [f64; 2],
            rotation: [f32; 2],
            velocity: [f32; 3],
            padding: u32,
        }
        let key = Key {
            id: body.id,
            position: body.position.to_array(),
            rotation: [body.rotation.c, body.rotation.s],
            velocity: [body.velocity.x, body.velocity.y, body.angular_velocity],
            padding: 0,
        };
        self.state = self.state.wrapping_add(xxh3_128(bytemuck::bytes_of(&key)));
    }

    /// How long a body has rested is part of the future, where bodies may sleep.
    pub(crate) fn add_rest(&mut self, id: GlobalId, still: f32) {
        let key = [id.0, u64::from(still.to_bits())];
        self.contact = self.contact.wrapping_add(xxh3_128(bytemuck::bytes_of(&key)));
    }

    pub(crate) fn add_contact(&mut self, tile: TileId, pair: (GlobalId, GlobalId), contact: &Contact) {
        #[derive(Clone, Copy, Pod, Zeroable)]
        #[repr(C)]
        struct Key {
            pair: [GlobalId; 2],
            contact: Contact,
            tile: u64,
        }
        let key = Key { pair: [pair.0, pair.1], contact: *contact, tile: u64::from(tile.0) };
        self.contact = self.contact.wrapping_add(xxh3_128(bytemuck::bytes_of(&key)));
    }
}

impl fmt::Display for Hashes {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{:032x} {:032x}", self.state, self.contact)
    }
}
