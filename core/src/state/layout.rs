//! How records lie in memory, which is how they are sent, saved and hashed: nobody may change it without noticing.

/// Asserts, as the crate is compiled, where every field of a record lies and how large the record is, in bytes.
macro_rules! layout {
    ($record:ident { $($field:ident: $offset:literal),+ $(,)? } $size:literal) => {
        const _: () = {
            $(assert!(
                std::mem::offset_of!($record, $field) == $offset,
                concat!(
                    "`", stringify!($field), "` of `", stringify!($record), "` does not lie where records that were sent or ",
                    "saved have it. If that is meant: grow `codec::FORMAT` and `snapshot::SNAPSHOT_FORMAT`, say **results** in ",
                    "CHANGELOG.md, and write the new layout where this one stands. If not: put the fields back in order."
                )
            );)+
            assert!(
                size_of::<$record>() == $size,
                concat!(
                    "`", stringify!($record), "` has another size than records that were sent or saved. If that is meant: grow ",
                    "`codec::FORMAT` and `snapshot::SNAPSHOT_FORMAT`, and write the new size where this one stands."
                )
            );
            // A field that is not named here does not compile.
            let _ = |$record { $($field: _),+ }: $record| {};
        };
    };
}
pub(crate) use layout;

use crate::exchange::record::{
    BorderImpulse, BorderPoint, ContactRecord, GhostRecord, GhostRefresh, MigrantRecord, Unseen,
};
use crate::model::body::Body;
use crate::model::contact::{Contact, ContactPoint};
use crate::model::math::Rot;

layout!(Rot { c: 0, s: 4 } 8);
layout!(Body { id: 0, position: 8, rotation: 24, velocity: 32, angular_velocity: 40, kind: 44 } 48);
layout!(ContactPoint { anchor: 0, separation: 8, normal_impulse: 12, tangent_impulse: 16, feature: 20 } 24);
layout!(Contact { normal: 0, offset: 8, rotation_a: 16, rotation_b: 24, points: 32 } 80);
layout!(ContactRecord { low: 0, high: 8, standing: 16, contact: 24 } 104);
layout!(Unseen { linear: 0, angular: 8 } 12);
layout!(MigrantRecord { body: 0, rested: 48, padding: 52 } 56);
layout!(GhostRecord { body: 0, unseen: 48, rested: 60 } 64);
layout!(GhostRefresh { id: 0, velocity: 8, pose: 20, unseen: 36 } 48);
layout!(BorderImpulse { low: 0, high: 8, points: 16 } 64);
layout!(BorderPoint { feature: 0, total_normal: 4, total_tangent: 8, normal: 12, tangent: 16, blow: 20 } 24);
