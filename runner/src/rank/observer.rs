//! How a run is watched, and stopped.

use super::meeting::Host;
use super::trace::TraceSteps;
use atoll_core::World;
use atoll_transport::Rank;
use std::fmt::{Debug, Display};
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

/// Sees the world of each rank while it is run. It may make a rank wait; it can change nothing.
pub trait Watcher: Debug + Send + Sync {
    /// Whether to be shown what is there after so many steps. All ranks must be told the same.
    fn wants(&self, step: u64) -> bool;
    /// What a rank holds after a step that is wanted. Each rank shows this on its own thread, and goes on afterwards.
    fn see(&self, rank: Rank, world: &World);
}

/// How a run is watched. The usual one hears nothing and never stops it.
#[derive(Clone, Default, Debug)]
pub struct Observer {
    /// Who hears of it.
    pub listener: Option<Arc<dyn Listener>>,
    /// Who sees it.
    pub watcher: Option<Arc<dyn Watcher>>,
    /// Who lets ranks meet between steps, and asks them.
    pub host: Option<Arc<dyn Host>>,
    /// Ends the run early.
    pub stop: StopFlag,
    /// Lets a rank panic.
    pub panic_at: Option<PanicAt>,
    /// Which steps to trace, if any.
    pub trace: Option<TraceSteps>,
    /// Steps that were completed here, by the rank that said so last; so that they are known even after a panic.
    pub complete: Arc<AtomicU64>,
}

impl Observer {
    /// Tells the user.
    pub(super) fn note(&self, text: &str) {
        if let Some(listener) = &self.listener {
            listener.note(text);
        }
        if let Some(host) = &self.host {
            host.note(text);
        }
    }

    /// Lets whoever has ranks meet know why the run failed.
    pub(crate) fn fail(&self, why: &dyn Display) {
        if let Some(host) = &self.host {
            host.fail(&why.to_string());
        }
    }

    /// Shows what a rank holds, if somebody wants to see it.
    pub(super) fn show(&self, rank: Rank, world: &World) {
        if let Some(watcher) = self.watcher.as_deref().filter(|watcher| watcher.wants(world.step_count())) {
            watcher.see(rank, world);
        }
    }

    /// Tells of steps until it is dropped, if it `speaks`.
    pub(crate) fn steps(&self, speaks: bool, from: u64, steps: u64) -> Steps<'_> {
        let listener = self.listener.as_deref().filter(|_| speaks);
        listener.inspect(|listener| listener.begins(from, steps));
        Steps(listener)
    }
}

/// Tells of the steps of a run, and that it ends, also where it fails.
#[derive(Debug)]
pub(crate) struct Steps<'a>(Option<&'a dyn Listener>);

impl Steps<'_> {
    pub(crate) fn made(&self, steps: u64) {
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

#[cfg(test)]
mod tests {
    use super::*;
    use std::sync::Mutex;

    /// Writes down what it hears.
    #[derive(Debug, Default)]
    struct Heard(Mutex<Vec<String>>);

    impl Heard {
        fn add(&self, what: String) {
            self.0.lock().unwrap().push(what);
        }
    }

    impl Listener for Heard {
        fn begins(&self, from: u64, steps: u64) {
            self.add(format!("from {from} to {steps}"));
        }

        fn made(&self, steps: u64) {
            self.add(format!("made {steps}"));
        }

        fn ends(&self) {
            self.add("ends".to_owned());
        }

        fn note(&self, text: &str) {
            self.add(text.to_owned());
        }
    }

    #[test]
    fn a_listener_hears_of_rank_0_alone_and_of_the_end_however_it_comes() {
        let heard = Arc::new(Heard::default());
        let observer = Observer { listener: Some(heard.clone()), ..Observer::default() };
        observer.note("on the way");
        for (speaks, from) in [(true, 3), (false, 5)] {
            let failed = std::panic::catch_unwind(std::panic::AssertUnwindSafe(|| {
                let told = observer.steps(speaks, from, 9);
                told.made(from + 1);
                std::panic::resume_unwind(Box::new("in the middle"));
            }));
            assert!(failed.is_err());
        }
        assert_eq!(*heard.0.lock().unwrap(), ["on the way", "from 3 to 9", "made 4", "ends"]);
    }

    #[test]
    fn whoever_asks_first_is_told_so() {
        let flag = StopFlag::default();
        assert!(!flag.is_requested());
        assert!(flag.request() && !flag.clone().request() && flag.is_requested());
        assert!(StopFlag::default().asking(|| true).is_requested());
    }

    #[test]
    fn where_to_panic_is_a_rank_and_a_step() {
        assert_eq!("2@100".parse(), Ok(PanicAt { rank: 2, step: 100 }));
        for text in ["2", "2@", "@100", "two@100", "2@-1"] {
            assert!(text.parse::<PanicAt>().is_err(), "{text}");
        }
    }
}
