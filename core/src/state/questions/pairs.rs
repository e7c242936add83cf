//! Who touches whom, two by two, and which pairs are new from one step to the next.

use crate::model::id::GlobalId;
use crate::world::World;

impl World {
    /// The pairs that [touch](Self::touching), of bodies and of bodies with statics: the lower name first, ascending. With several ranks
    /// the answers of all of them, joined, are those of one rank that holds everything.
    ///
    /// For those that began with a step, and that ended, see [`pairs_not_in`].
    pub fn contact_pairs(&self) -> Vec<(GlobalId, GlobalId)> {
        let contacts = self.views().flat_map(|tile| tile.contacts());
        // Of one between two tiles the owner of body A tells.
        let own = contacts.filter(|contact| !contact.is_border || contact.owned[0].is_some());
        let mut pairs: Vec<_> = own.map(|contact| (contact.bodies[0], contact.bodies[1])).collect();
        pairs.retain(|&(a, b)| !self.was_removed(a) && !self.was_removed(b));
        pairs.sort_unstable();
        // Two bodies of several pieces may have several.
        pairs.dedup();
        pairs
    }
}

/// Of ascending pairs those that are not among others, which ascend as well: of what [`World::contact_pairs`] or
/// [`World::inside_sensors`] tell after a step, without what they told before it, those that began; the other way round those that ended.
pub fn pairs_not_in<T: Ord + Copy>(pairs: &[T], others: &[T]) -> Vec<T> {
    let mut others = others.iter().peekable();
    let is_new = |pair: &&T| {
        while others.next_if(|other| other < pair).is_some() {}
        others.peek() != Some(pair)
    };
    pairs.iter().filter(is_new).copied().collect()
}
