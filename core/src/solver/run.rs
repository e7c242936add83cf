//! Substeps by the solver that was chosen.

use super::job::Job;
use super::{pgs, soft_step};
use crate::model::params::Solver;
use crate::parallel::crew::Member;
use crate::parallel::lanes::{Kernel, Lanes};
use crate::tiling::blueprint::Setup;
use std::ops::Range;

/// Some substeps of a job, as one member of its crew, or alone.
pub(crate) struct Run<'a> {
    pub(crate) job: &'a Job<'a>,
    pub(crate) member: Member<'a>,
    pub(crate) substeps: Range<u32>,
    pub(crate) setup: &'a Setup,
}

impl Kernel for Run<'_> {
    type Output = ();
    #[inline(always)]
    fn run<V: Lanes>(self) {
        let Self { job, member, substeps, setup } = self;
        for substep in substeps {
            match setup.params.solver {
                Solver::SoftStep => soft_step::substep::<V>(job, &member, substep, setup),
                Solver::Pgs => pgs::substep::<V>(job, &member, substep, setup),
            }
        }
    }
}
