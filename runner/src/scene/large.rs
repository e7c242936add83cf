//! Which bodies of a scene are so large, and so few, that halos are better not as wide as they need them.

use atoll_core::Kind;

/// Of so many bodies one may be large.
const ONE_OF: u64 = 500;

/// Who would make the halo more than so many times as wide as others need it is large, if such are few.
const WIDER: f32 = 2.0;

/// Whether kinds differ so much in size that it matters how many there are of each.
pub(super) fn may_be(kinds: &[Kind]) -> bool {
    let radii = || kinds.iter().map(|kind| kind.shape.bounding_radius());
    radii().fold(0.0, f32::max) > WIDER * radii().fold(f32::INFINITY, f32::min)
}

/// The bounding radius beyond which bodies are large, in meters, by how many there are of each kind; where that is not known, none
/// of these kinds is.
pub(super) fn radius(kinds: &[Kind], counts: Option<&[u64]>, margin_cap: f32) -> f32 {
    let mut sizes: Vec<(f32, u64)> = (0..kinds.len())
        .map(|kind| (kinds[kind].shape.bounding_radius(), counts.map_or(1, |counts| counts[kind])))
        .collect();
    sizes.sort_unstable_by(|(a, _), (b, _)| b.total_cmp(a));
    let most = counts.map_or(0, |counts| counts.iter().sum::<u64>() / ONE_OF);
    let mut larger = 0;
    let usual = sizes.iter().find(|(_, count)| {
        larger += count;
        larger > most
    });
    usual.map_or(f32::INFINITY, |(usual, _)| WIDER * (usual + margin_cap) - margin_cap)
}

#[cfg(test)]
mod tests {
    use super::*;
    use atoll_core::{Material, Shape};

    #[test]
    fn few_bodies_that_are_much_larger_are_large() {
        let kinds = [0.3, 25.0, 0.5, 2.0].map(|radius| Kind::new(Shape::circle(radius), Material::default()));
        let radius = |counts: [u64; 4]| radius(&kinds, Some(&counts), 0.5);
        assert_eq!(radius([1000, 1, 1000, 0]), 1.5);
        assert_eq!(radius([1000, 4, 1000, 0]), 1.5);
        assert_eq!(radius([1000, 5, 1000, 0]), 50.5);
        assert_eq!(radius([1000, 1, 1000, 100]), 4.5);
        // Of a few hundred none is; but what nobody has makes no halo wide.
        assert_eq!(radius([100, 1, 100, 0]), 50.5);
        assert_eq!(radius([100, 0, 100, 0]), 1.5);
        assert_eq!(radius([0; 4]), f32::INFINITY);
        assert_eq!(super::radius(&kinds, None, 0.5), 50.5);
        assert!(may_be(&kinds) && !may_be(&kinds[..1]));
    }
}
