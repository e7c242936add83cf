//! Which bodies of a scene are so large, and so few, that halos are better not as wide as they need them.

use atoll_core::Kind;

/// Of so many bodies one may be large.
const ONE_OF: u64 = 500;

/// Where the halo would not be so many times as wide, none is.
const WIDER: f32 = 2.0;

/// Whether kinds differ so much in size that some may be large.
pub(super) fn may_be(kinds: &[Kind]) -> bool {
    let radii = || kinds.iter().map(|kind| kind.shape.bounding_radius());
    radii().fold(0.0, f32::max) > WIDER * radii().fold(f32::INFINITY, f32::min)
}

/// The bounding radius beyond which bodies are large, in meters, by how many there are of each kind: the least that leaves few of
/// them; infinity where they are not much larger than others, or nothing is known of how many there are.
pub(super) fn radius(kinds: &[Kind], counts: &[u64], margin_cap: f32) -> f32 {
    let mut sizes: Vec<(f32, u64)> =
        kinds.iter().map(|kind| kind.shape.bounding_radius()).zip(counts.iter().copied()).collect();
    sizes.sort_unstable_by(|(a, _), (b, _)| b.total_cmp(a));
    let most = counts.iter().sum::<u64>() / ONE_OF;
    let mut larger = 0;
    let usual = sizes.iter().find(|(_, count)| {
        larger += count;
        larger > most
    });
    match (sizes.first(), usual) {
        (Some((largest, _)), Some((usual, _))) if largest + margin_cap >= WIDER * (usual + margin_cap) => *usual,
        _ => f32::INFINITY,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use atoll_core::{Material, Shape};

    #[test]
    fn few_bodies_that_are_much_larger_are_large() {
        let radii = [0.3, 25.0, 0.5, 1.0];
        let kinds = radii.map(|radius| Kind::new(Shape::circle(radius), Material::default()));
        let radius = |counts: [u64; 4]| radius(&kinds, &counts, 0.5);
        assert_eq!(radius([1000, 1, 1000, 0]), 0.5);
        assert_eq!(radius([1000, 4, 1000, 0]), 0.5);
        assert_eq!(radius([1000, 5, 1000, 0]), f32::INFINITY);
        assert_eq!(radius([1000, 1, 1000, 100]), 1.0);
        // Of a few hundred none is; but what nobody has makes no halo wide.
        assert_eq!(radius([100, 1, 100, 0]), f32::INFINITY);
        assert_eq!(radius([100, 0, 100, 0]), 0.5);
        assert_eq!(radius([0; 4]), f32::INFINITY);
        assert!(may_be(&kinds) && !may_be(&kinds[2..]));
        // A halo that is wide anyway is worth no exchange.
        assert_eq!(super::radius(&kinds[2..], &[10_000, 1], 0.5), f32::INFINITY);
        assert_eq!(super::radius(&kinds, &[], 0.5), f32::INFINITY);
    }
}
