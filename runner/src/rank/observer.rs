//! How a run is watched, and stopped.

use std::fmt::Debug;
use std::str::FromStr;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};

/// Hears what a run has to say while it goes on. Of all ranks, only rank 0 speaks.
pub trait Listener: Debug + Send + Sync {
    /// The run is about to make its first step: `from` of all `steps` were made before.
    fn begins(&self, from: u64, steps: u64);
    /// So many steps are made.
    fn made(&self, steps: u64);
    /// No more steps will be made, whether or not all were.
    fn ends(&self);
    /// The user may want to know this, a sentence.
    fn note(&self, text: &str);
}

/// How a run is watched. The usual one hears nothing and never stops it.
#[derive(Clone, Default, Debug)]
pub struct Observer {
    /// Who hears of it.
    pub listener: Option<Arc<dyn Listener>>,
    /// Ends the run early.
    pub stop: StopFlag,
    /// Lets a rank panic.
    pub panic_at: Option<PanicAt>,
    /// Steps that were completed here, by the rank that said so last; so that they are known even after a panic.
    pub complete: Arc<AtomicU64>,
}

impl Observer {
    /// Tells the user.
    pub(super) fn note(&self, text: &str) {
        if let Some(listener) = &self.listener {
            listener.note(text);
        }
    }

    /// Tells of steps until it is dropped, if it `speaks`.
    pub(super) fn steps(&self, speaks: bool, from: u64, steps: u64) -> Steps<'_> {
        let listener = self.listener.as_deref().filter(|_| speaks);
        listener.inspect(|listener| listener.begins(from, steps));
        Steps(listener)
    }
}

/// Tells of the steps of a run, and that it ends, also where it fails.
#[derive(Debug)]
pub(super) struct Steps<'a>(Option<&'a dyn Listener>);

impl Steps<'_> {
    pub(super) fn made(&self, steps: u64) {
        self.0.inspect(|listener| listener.made(steps));
    }
}

impl Drop for Steps<'_> {
    fn drop(&mut self) {
        self.0.inspect(|listener| listener.ends());
    }
}

/// A request to stop, shared by whoever may make it and every rank of this process.
#[derive(Clone, Default, Debug)]
pub struct StopFlag {
    raised: Arc<AtomicBool>,
    /// Somebody else who may know of one.
    elsewhere: Option<fn() -> bool>,
}

impl StopFlag {
    /// Asks the run to end after the step under way. Says whether nobody had asked before.
    pub fn request(&self) -> bool {
        !self.raised.swap(true, Ordering::Relaxed)
    }

    /// Whether somebody asked.
    pub fn is_requested(&self) -> bool {
        self.raised.load(Ordering::Relaxed) || self.elsewhere.is_some_and(|requested| requested())
    }

    /// This flag, raised as well when `elsewhere` says so.
    pub fn asking(self, elsewhere: fn() -> bool) -> Self {
        Self { elsewhere: Some(elsewhere), ..self }
    }
}

/// Where a rank is to panic.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct PanicAt {
    /// The rank.
    pub rank: u32,
    /// The step, counted from 0.
    pub step: u64,
}

impl FromStr for PanicAt {
    type Err = &'static str;

    fn from_str(text: &str) -> Result<Self, Self::Err> {
        let parts = text.split_once('@').and_then(|(rank, step)| Some((rank.parse().ok()?, step.parse().ok()?)));
        parts.map(|(rank, step)| Self { rank, step }).ok_or("write RANK@STEP, such as 2@100")
    }
}
