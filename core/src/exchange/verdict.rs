//! What all ranks must hear, and act on at the same step.

use crate::model::id::GlobalId;

/// What every rank must know of every other: rides on each exchange.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub struct Verdict {
    /// Somebody asks the run to stop.
    pub stop: bool,
    /// Somebody asks all ranks to meet after this step.
    pub meet: bool,
    /// A body reaches further in this step than halos are wide: another sync point follows the first one.
    pub far: bool,
    /// A check failed: the step and the lowest body concerned.
    pub failure: Option<(u64, GlobalId)>,
}

impl Verdict {
    /// Joins two: any stop, any wish to meet, any body that goes far, the earliest failure.
    pub fn merge(self, other: Self) -> Self {
        let failure = match (self.failure, other.failure) {
            (Some(a), Some(b)) => Some(a.min(b)),
            (a, b) => a.or(b),
        };
        Self { stop: self.stop | other.stop, meet: self.meet | other.meet, far: self.far | other.far, failure }
    }

    /// As a word for the outside to carry: the least word of all ranks stands for all their verdicts joined. A failure
    /// hides a stop, and a stop a wish to meet, which makes no difference: they end the run. All of these hide whether a body
    /// reaches far: then `is_far` takes it for granted.
    pub fn to_word(self) -> u128 {
        match self {
            // A run never counts as many steps as would make this one of the words below.
            Self { failure: Some((step, id)), .. } => u128::from(step) << 64 | u128::from(id.0),
            Self { stop: true, .. } => Self::STOP,
            Self { meet: true, .. } => Self::MEET,
            Self { far: true, .. } => Self::FAR,
            Self { .. } => Self::NOTHING,
        }
    }

    /// Reads [`to_word`](Self::to_word).
    pub fn from_word(word: u128) -> Self {
        match word {
            Self::NOTHING => Self::default(),
            Self::FAR => Self { far: true, ..Self::default() },
            Self::MEET => Self { meet: true, ..Self::default() },
            Self::STOP => Self { stop: true, ..Self::default() },
            _ => Self { failure: Some(((word >> 64) as u64, GlobalId(word as u64))), ..Self::default() },
        }
    }

    /// Whether another sync point is to follow the first one of a step. That changes nothing where no body reaches far.
    pub(crate) fn is_far(self) -> bool {
        self.far | self.stop | self.meet
    }

    const NOTHING: u128 = u128::MAX;
    const FAR: u128 = u128::MAX - 1;
    const MEET: u128 = u128::MAX - 2;
    const STOP: u128 = u128::MAX - 3;
}
