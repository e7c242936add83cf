//! A configuration that is run only to be looked at: its ranks are threads, and nothing of it is kept.

use super::parts::Parts;
use super::{End, Show, Shown};
use crate::config::{Config, TransportKind};
use crate::error::RunError;
use crate::folder::recording::RunFacts;
use crate::launch;
use crate::look::frame::{Frame, Setting};
use crate::plan::Plan;
use crate::rank::Observer;
use crate::scene::SceneError;
use crate::summary::Summary;
use atoll_core::{Blueprint, GlobalId};
use atoll_transport::Rank;
use std::panic;
use std::sync::Arc;
use std::thread;

/// A plan to be run and looked at.
#[derive(Debug)]
pub(crate) struct Live {
    plan: Plan,
    setting: Setting,
}

impl Live {
    /// Refuses a configuration whose ranks are processes.
    ///
    /// # Errors
    /// If it is one.
    pub(crate) fn check(config: &Config) -> Result<(), RunError> {
        match config.transport() {
            TransportKind::Local | TransportKind::Channel => Ok(()),
            kind @ (TransportKind::Iceoryx2 | TransportKind::Mpi) => Err(RunError::Unsuitable {
                option: format!("transport {}", kind.name()),
                reason: "a run is looked at within one process; give --transport channel".to_owned(),
            }),
        }
    }

    /// That of a plan whose ranks are threads.
    pub(crate) fn new(plan: Plan) -> Self {
        let Blueprint { partition, kinds, statics, .. } = plan.blueprint.clone();
        // As a recording of it would tell.
        let facts = RunFacts::new(&plan.config, plan.scene.domain(), plan.tiles, 1);
        let hertz = facts.hertz().expect("every configuration has a frequency");
        let names = plan.kind_names().to_vec();
        Self { setting: Setting { partition, kinds, names, statics, hertz }, plan }
    }

    /// The plan.
    pub(crate) fn plan(&self) -> &Plan {
        &self.plan
    }

    /// What stays as it is.
    pub(crate) fn setting(&self) -> &Setting {
        &self.setting
    }

    /// Whether a dynamic body has that name.
    ///
    /// # Errors
    /// If the files of its scene cannot be read any more.
    pub(crate) fn has(&self, body: GlobalId) -> Result<bool, SceneError> {
        Ok(self.plan.scene.find(body)?.is_some())
    }

    /// Runs it, and lets `show` see its frames, with what only a run can tell if `live`. It is run no further than the last of
    /// them. Where `show` fails, the run is stopped.
    ///
    /// # Errors
    /// What `show` returns, or else what ended the run.
    pub(crate) fn show(
        &mut self,
        shown: Shown,
        live: bool,
        observer: Observer,
        show: &mut Show<'_>,
    ) -> Result<(End, Summary), RunError> {
        // A run makes at least one step.
        self.plan.config.run.steps = shown.last.max(1);
        let plan = &self.plan;
        let parts = Arc::new(Parts::new(shown, live, plan.assignment.ranks()));
        let stop = observer.stop.clone();
        let observer = Observer { watcher: Some(parts.clone()), ..observer };
        let (shown, ran) = thread::scope(|scope| {
            let run = || {
                let _ends = AtEnd(|| parts.end());
                launch::run(plan, &observer)
            };
            let run = thread::Builder::new().name("run".to_owned()).spawn_scoped(scope, run);
            let run =
                run.map_err(|error| RunError::Threads { rank: Rank(0), threads: 1, reason: error.to_string() })?;
            let shown = {
                let _closes = AtEnd(|| parts.close());
                Self::take_all(&parts, show)
            };
            if shown.is_err() {
                stop.request();
            }
            let ran = run.join().unwrap_or_else(|payload| panic::resume_unwind(payload));
            Ok::<_, RunError>((shown, ran))
        })?;
        shown?;
        let summary = ran?;
        RunError::check_bodies(summary.bodies, summary.bodies_lost)?;
        let end = if summary.interrupted { End::Interrupted } else { End::Complete };
        Ok((end, summary))
    }

    fn take_all(parts: &Parts, show: &mut Show<'_>) -> Result<(), RunError> {
        let mut frame = Frame::default();
        while parts.take(&mut frame) {
            show(&frame)?;
        }
        Ok(())
    }
}

/// Does something when it is dropped, also after a panic.
struct AtEnd<F: Fn()>(F);

impl<F: Fn()> Drop for AtEnd<F> {
    fn drop(&mut self) {
        self.0();
    }
}
