//! Substeps by the solver that was chosen.

use super::crew::Member;
use super::job::Job;
use super::lanes::{Kernel, Lanes};
use super::{pgs, soft_step};
use crate::params::Solver;
use crate::setup::Setup;
use std::ops::Range;

/// Some substeps of a job, as one member of its crew, or alone.
pub(super) struct Run<'a> {
    pub(super) job: &'a Job<'a>,
    pub(super) member: Member<'a>,
    pub(super) substeps: Range<u32>,
    pub(super) setup: &'a Setup,
}

impl Kernel for Run<'_> {
    type Output = ();
    #[inline(always)]
    fn run<V: Lanes>(self) {
        let Self { job, member, substeps, setup } = self;
        for substep in substeps {
            match setup.params.solver {
                Solver::SoftStep => soft_step::substep::<V>(job, &member, substep, setup),
                Solver::Pgs => pgs::step::<V>(job, &member, setup),
            }
        }
    }
}
