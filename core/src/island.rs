//! Islands: bodies connected through contacts. Statics connect nothing.
//!
//! Union by index with path halving: the representative of an island is its lowest body, whatever the order of the
//! unions, so the result is a function of the contacts alone. Source: R. Tarjan and J. van Leeuwen, "Worst-case
//! analysis of set union algorithms", 1984.

#[cfg(test)]
mod tests;

/// Disjoint sets of the numbers below some bound.
#[derive(Default, Debug)]
pub struct UnionFind {
    parent: Vec<u32>,
}

impl UnionFind {
    /// Forgets everything; `count` sets of one.
    pub fn reset(&mut self, count: usize) {
        self.parent.clear();
        self.parent.extend(0..count as u32);
    }

    /// The lowest number in the set of `i`.
    #[inline]
    pub fn find(&mut self, mut i: u32) -> u32 {
        loop {
            let parent = self.parent[i as usize];
            if parent == i {
                return i;
            }
            let above = self.parent[parent as usize];
            self.parent[i as usize] = above;
            i = above;
        }
    }

    /// Joins the sets of two numbers.
    #[inline]
    pub fn union(&mut self, a: u32, b: u32) {
        let (a, b) = (self.find(a), self.find(b));
        if a < b {
            self.parent[b as usize] = a;
        } else {
            self.parent[a as usize] = b;
        }
    }
}

/// How many islands there are, and how many bodies the largest holds.
#[derive(Clone, Copy, PartialEq, Eq, Default, Debug)]
pub struct IslandSizes {
    /// Sets of bodies connected through contacts; a body without contacts is none.
    pub islands: u64,
    /// Bodies in the largest.
    pub largest: u64,
}

/// Buffers to find islands with.
#[derive(Default, Debug)]
pub struct Islands {
    sets: UnionFind,
    size: Vec<u32>,
    roots: Vec<u32>,
}

impl Islands {
    /// Finds the islands among `count` bodies joined by `contacts`. Every body counts, also one without contacts.
    pub(crate) fn find(
        &mut self,
        _search: crate::IslandSearch,
        count: usize,
        contacts: &[[u32; 2]],
        _team: crate::team::Team,
    ) -> IslandSizes {
        self.sets.reset(count);
        for &[a, b] in contacts {
            self.sets.union(a, b);
        }
        self.roots.clear();
        self.size.clear();
        self.size.resize(count, 0);
        let mut sizes = IslandSizes::default();
        for body in 0..count as u32 {
            let root = self.sets.find(body) as usize;
            self.roots.push(root as u32);
            sizes.islands += u64::from(root == body as usize);
            self.size[root] += 1;
            sizes.largest = sizes.largest.max(u64::from(self.size[root]));
        }
        sizes
    }

    pub(crate) fn roots(&self) -> &[u32] {
        &self.roots
    }
}
