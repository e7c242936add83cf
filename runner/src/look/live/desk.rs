//! Where pages and who shows them a world meet: what pages want, and what is ready for each. Nobody waits for a page here:
//! each has room for one frame, which a newer one replaces, and is given another once it has drawn the last.

#[cfg(test)]
mod tests;

use super::protocol::{Gaze, Say, Wish};
use crate::command::{Word, word};
use crate::wording::OneLine;
use std::collections::BTreeMap;
use std::mem::discriminant;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Condvar, Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

/// Pages at a time.
const MOST_PAGES: usize = 16;

/// Commands that wait to be done; more than that are not taken.
const MOST_COMMANDS: usize = 1024;

/// Texts that wait for one page; who does not read them misses the older ones.
const MOST_TEXTS: usize = 64;

/// The least time between two frames for one page.
const FRAME: Duration = Duration::from_millis(33);

/// A body that is so near to where somebody has pointed is meant, in pixels.
const NEAR: f64 = 3.0;

/// Which page.
pub(crate) type PageId = u64;

/// How time is to go on. All pages share it.
#[derive(Clone, Copy, PartialEq, Debug)]
pub(crate) struct Pace {
    /// Whether it does.
    pub playing: bool,
    /// Seconds in a second; 0: as many as can be.
    pub times: f64,
    /// Steps or records to make, or to go back, whether or not it does.
    pub by: i64,
    /// The step to go to.
    pub seek: Option<u64>,
}

/// A page's frame that is due.
#[derive(Clone, Copy, PartialEq, Debug)]
pub(crate) struct Due {
    /// For whom.
    pub page: PageId,
    /// What it looks at.
    pub gaze: Gaze,
    /// The number the frame is to have.
    pub number: u32,
    /// What there is to see now.
    pub version: u64,
    /// Whether the page has seen that coarsely.
    pub glimpsed: bool,
}

/// The body that somebody wants to know about: it is picked for all pages.
#[derive(Clone, Copy, PartialEq, Debug)]
pub(crate) enum Pick {
    /// Whichever is there: a world, a place, and how far from it at most, in m.
    At(u32, [f64; 2], f64),
    /// This one of that world.
    Body(u32, u64),
}

/// See the head of this file.
#[derive(Debug)]
pub(crate) struct Desk {
    /// Whether a page is there, so that who has nothing to do with pages need not lock.
    wanted: AtomicBool,
    inner: Mutex<Inner>,
    /// Somebody wants something.
    wish: Condvar,
    /// Something is ready.
    ready: Condvar,
}

#[derive(Debug)]
struct Inner {
    pages: BTreeMap<PageId, Page>,
    next: PageId,
    pace: Pace,
    /// How it is when nobody looks.
    usual: Pace,
    picked: Option<Pick>,
    /// How often somebody has wanted something.
    wishes: u64,
    /// What is to be done to the world, in lines.
    commands: Vec<String>,
    /// What each new page is told first.
    greeting: Vec<Say>,
    closed: bool,
}

#[derive(Default, Debug)]
struct Page {
    gaze: Option<Gaze>,
    /// Number of the last frame that was made for it.
    given: u32,
    /// Whether that was drawn, or none was made.
    free: bool,
    /// Whether it looks at something else since.
    moved: bool,
    /// What there was to see on the last frame.
    seen: Option<u64>,
    /// Whether that was coarse.
    coarse: bool,
    last: Option<Instant>,
    frames: Vec<Vec<u8>>,
    texts: Vec<String>,
}

/// What is ready for a page.
#[derive(Clone, PartialEq, Debug)]
pub(crate) enum Ready {
    /// Words, in order.
    Texts(Vec<String>),
    /// A frame, of each world.
    Frame(Vec<Vec<u8>>),
    /// Nothing, for now.
    Nothing,
    /// Nothing ever again.
    Closed,
}

impl Desk {
    /// One at which time goes on at this speed at first.
    pub(crate) fn new(times: f64) -> Self {
        let pace = Pace { playing: true, times, by: 0, seek: None };
        let (pages, commands, greeting) = Default::default();
        let inner =
            Inner { pages, next: 0, pace, usual: pace, picked: None, wishes: 0, commands, greeting, closed: false };
        Self { wanted: AtomicBool::new(false), inner: Mutex::new(inner), wish: Condvar::new(), ready: Condvar::new() }
    }

    fn lock(&self) -> MutexGuard<'_, Inner> {
        self.inner.lock().unwrap_or_else(PoisonError::into_inner)
    }

    // What the server does for a page.

    /// A page has come. None if there are too many, or no more are served.
    pub(crate) fn open(&self) -> Option<PageId> {
        let mut inner = self.lock();
        if inner.closed || inner.pages.len() >= MOST_PAGES {
            return None;
        }
        let id = inner.next;
        inner.next += 1;
        let pace = inner.pace.say();
        let pace = Some(&pace).filter(|_| !inner.greeting.is_empty());
        let texts = inner.greeting.iter().chain(pace).map(text).collect();
        inner.pages.insert(id, Page { free: true, texts, ..Page::default() });
        self.wanted.store(true, Ordering::Relaxed);
        Some(id)
    }

    /// A page has gone.
    pub(crate) fn close(&self, page: PageId) {
        let mut inner = self.lock();
        inner.pages.remove(&page);
        // Nobody is there who could let time go on again.
        if inner.pages.is_empty() {
            (inner.pace, inner.picked) = (inner.usual, None);
            self.wanted.store(false, Ordering::Relaxed);
        }
        inner.wishes += 1;
        drop(inner);
        self.wish.notify_all();
    }

    /// A page wants something.
    pub(crate) fn hear(&self, page: PageId, wish: Wish) {
        let mut inner = self.lock();
        let Inner { pages, pace, picked, wishes, commands, .. } = &mut *inner;
        *wishes += 1;
        let was = *pace;
        let Some(page) = pages.get_mut(&page) else { return };
        match wish {
            Wish::Look { view, size, color } => {
                page.gaze = Some(Gaze { view, size, color, coarseness: 1 });
                page.moved = true;
            }
            Wish::Ack { frame } => page.free |= frame == page.given,
            Wish::Play => pace.playing = true,
            Wish::Pause => pace.playing = false,
            Wish::Step { by } => (pace.playing, pace.by) = (false, pace.by.saturating_add(by.into())),
            Wish::Seek { step } => pace.seek = Some(step),
            Wish::Speed { times } => pace.times = times,
            Wish::Pick { source, at } => {
                let pixel = |gaze: Gaze| (gaze.view.high.x - gaze.view.low.x) / f64::from(gaze.size[0]);
                *picked = Some(Pick::At(source, at, NEAR * page.gaze.map_or(0.0, pixel)));
            }
            Wish::Drop => *picked = None,
            Wish::Command { line } if commands.len() < MOST_COMMANDS => commands.push(line),
            Wish::Command { .. } => {
                let full = "a hand on the page: too much waits to be done; this is left out".to_owned();
                page.texts.push(text(&Say::Note { text: full }));
            }
        }
        if inner.pace.say() != was.say() {
            inner.tell_pace();
            self.ready.notify_all();
        }
        drop(inner);
        self.wish.notify_all();
    }

    /// What is ready for a page, once something is, or after so long.
    pub(crate) fn next(&self, page: PageId, patience: Duration) -> Ready {
        let waits = |inner: &mut Inner| {
            !inner.closed && inner.pages.get(&page).is_some_and(|page| page.texts.is_empty() && page.frames.is_empty())
        };
        let (mut inner, _) =
            self.ready.wait_timeout_while(self.lock(), patience, waits).unwrap_or_else(PoisonError::into_inner);
        let closed = inner.closed;
        let Some(page) = inner.pages.get_mut(&page) else { return Ready::Closed };
        if !page.texts.is_empty() {
            Ready::Texts(std::mem::take(&mut page.texts))
        } else if !page.frames.is_empty() {
            Ready::Frame(std::mem::take(&mut page.frames))
        } else if closed {
            Ready::Closed
        } else {
            Ready::Nothing
        }
    }

    // What who shows the world does.

    /// Tells each page that comes from now on, first of all, and those that are there. What was told of the same before no longer
    /// counts.
    pub(crate) fn greet(&self, greeting: Say) {
        let mut inner = self.lock();
        inner.tell(&greeting);
        if matches!(greeting, Say::Hello(_)) {
            inner.greeting.clear();
            inner.tell_pace();
        }
        inner.greeting.retain(|earlier| discriminant(earlier) != discriminant(&greeting));
        inner.greeting.push(greeting);
        drop(inner);
        self.ready.notify_all();
    }

    /// Tells all pages.
    pub(crate) fn tell(&self, say: &Say) {
        self.lock().tell(say);
        self.ready.notify_all();
    }

    /// Whether a page is there. Costs nothing.
    pub(crate) fn is_wanted(&self) -> bool {
        self.wanted.load(Ordering::Relaxed)
    }

    /// The frames that are due when there is this to see: of pages that have drawn their last one, a while ago, and have not seen
    /// it yet, or look elsewhere.
    pub(crate) fn due(&self, version: u64) -> Vec<Due> {
        let now = Instant::now();
        let due = |(&page, of): (&PageId, &Page)| {
            let gaze = of.gaze.filter(|_| of.wants(version) && of.rests(now).is_zero())?;
            let glimpsed = of.seen == Some(version) && !of.moved;
            Some(Due { page, gaze, number: of.given.wrapping_add(1), version, glimpsed })
        };
        self.lock().pages.iter().filter_map(due).collect()
    }

    /// How long until a frame is due, if nobody wants anything else.
    pub(crate) fn rests(&self, version: u64) -> Option<Duration> {
        let now = Instant::now();
        self.lock().pages.values().filter(|page| page.wants(version)).map(|page| page.rests(now)).min()
    }

    /// Gives a page its frame, of each world.
    pub(crate) fn give(&self, due: &Due, frames: Vec<Vec<u8>>) {
        let mut inner = self.lock();
        if let Some(page) = inner.pages.get_mut(&due.page) {
            page.frames = frames;
            page.seen = Some(due.version);
            page.coarse = due.gaze.coarseness > 1;
            page.given = due.number;
            page.free = false;
            page.moved &= page.gaze != Some(Gaze { coarseness: 1, ..due.gaze });
            page.last = Some(Instant::now());
        }
        drop(inner);
        self.ready.notify_all();
    }

    /// Whether pages want something done to the world.
    pub(crate) fn has_commands(&self) -> bool {
        !self.lock().commands.is_empty()
    }

    /// What pages want done after so many steps, as lines with numbers, if there is anything.
    pub(crate) fn take_commands(&self, steps: u64) -> Option<Vec<u8>> {
        let mut inner = self.lock();
        if inner.commands.is_empty() {
            return None;
        }
        let commands = std::mem::take(&mut inner.commands);
        // What there is to see is not what it was after as many steps.
        inner.pages.values_mut().for_each(|page| page.seen = None);
        drop(inner);
        let line = |line: &String| {
            let line = OneLine(line).to_string();
            // All ranks will say what is wrong with it.
            let line = if let Ok(Word::Line(_, line)) = word(0, &line, steps) { line } else { line };
            format!("0\t{line}\n")
        };
        Some(commands.iter().map(line).collect::<String>().into_bytes())
    }

    /// How time is to go on; what was to be done once is taken.
    pub(crate) fn take_pace(&self) -> Pace {
        let pace = &mut self.lock().pace;
        let taken = *pace;
        (pace.by, pace.seek) = (0, None);
        taken
    }

    /// Lets time stand still.
    pub(crate) fn pause(&self) {
        let mut inner = self.lock();
        inner.pace.playing = false;
        inner.tell_pace();
        drop(inner);
        self.ready.notify_all();
    }

    /// The body somebody wants to know about.
    pub(crate) fn picked(&self) -> Option<Pick> {
        self.lock().picked
    }

    /// Which body it is that somebody wants to know about, or that there is none.
    pub(crate) fn found(&self, asked: Pick, found: Option<Pick>) {
        let picked = &mut self.lock().picked;
        if *picked == Some(asked) {
            *picked = found;
        }
    }

    /// How time is to go on.
    pub(crate) fn pace(&self) -> Pace {
        self.lock().pace
    }

    /// One of the steps that were to be made whether or not time goes on is made.
    pub(crate) fn made_one(&self) {
        self.lock().pace.by -= 1;
    }

    /// How often somebody has wanted something.
    pub(crate) fn wishes(&self) -> u64 {
        self.lock().wishes
    }

    /// Waits until somebody has wanted something more than so often, but no longer than `patience`.
    pub(crate) fn wait(&self, wishes: u64, patience: Duration) {
        let waits = |inner: &mut Inner| inner.wishes == wishes && !inner.closed;
        drop(self.wish.wait_timeout_while(self.lock(), patience, waits));
    }

    /// Nothing more will be shown. Who waits for it is told.
    pub(crate) fn end(&self) {
        let mut inner = self.lock();
        inner.tell(&Say::Over);
        inner.closed = true;
        drop(inner);
        self.wish.notify_all();
        self.ready.notify_all();
    }
}

impl Inner {
    fn tell(&mut self, say: &Say) {
        for page in self.pages.values_mut() {
            if page.texts.len() == MOST_TEXTS {
                page.texts.remove(0);
            }
            page.texts.push(text(say));
        }
    }

    fn tell_pace(&mut self) {
        self.tell(&self.pace.say());
    }
}

impl Pace {
    /// What pages are told of it.
    fn say(&self) -> Say {
        Say::Pace { playing: self.playing, times: self.times }
    }
}

impl Page {
    /// Whether it has room for a frame with this to see, and has not seen it as well as can be.
    fn wants(&self, version: u64) -> bool {
        self.gaze.is_some() && self.free && (self.moved || self.coarse || self.seen != Some(version))
    }

    /// How long it is to rest after its last frame.
    fn rests(&self, now: Instant) -> Duration {
        self.last.map_or(Duration::ZERO, |last| FRAME.saturating_sub(now - last))
    }
}

fn text(say: &Say) -> String {
    serde_json::to_string(say).expect("names, texts and numbers")
}
