//! Where pages and who shows them a world meet: what pages want, and what is ready for each. Nobody waits for a page here:
//! each has room for one frame, which a newer one replaces, and is given another once it has drawn the last.

use super::protocol::{Gaze, Say, Wish};
use std::collections::BTreeMap;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Condvar, Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

/// Pages at a time.
const MOST_PAGES: usize = 16;

/// Texts that wait for one page; who does not read them misses the older ones.
const MOST_TEXTS: usize = 64;

/// The least time between two frames for one page.
const FRAME: Duration = Duration::from_millis(33);

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
}

/// The body that somebody wants to know about: it is picked for all pages.
#[derive(Clone, Copy, PartialEq, Debug)]
pub(crate) enum Pick {
    /// Whichever is there: a world and a place in m.
    At(u32, [f64; 2]),
    /// This one of that world.
    Body(u32, u64),
}

/// See the head of this file.
#[derive(Debug)]
pub(crate) struct Desk {
    /// Whether somebody may want something, so that who has nothing to do with pages need not lock.
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
    /// What each new page is told first.
    greeting: Option<Say>,
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
    last: Option<Instant>,
    frame: Option<Vec<u8>>,
    texts: Vec<String>,
}

/// What is ready for a page.
#[derive(Clone, PartialEq, Debug)]
pub(crate) enum Ready {
    /// Words, in order.
    Texts(Vec<String>),
    /// A frame.
    Frame(Vec<u8>),
    /// Nothing, for now.
    Nothing,
    /// Nothing ever again.
    Closed,
}

impl Desk {
    /// One at which time goes on or stands still at first, at this speed.
    pub(crate) fn new(playing: bool, times: f64) -> Self {
        let pace = Pace { playing, times, by: 0, seek: None };
        let inner =
            Inner { pages: BTreeMap::new(), next: 0, pace, usual: pace, picked: None, greeting: None, closed: false };
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
        let texts = inner.greeting.iter().map(text).collect();
        inner.pages.insert(id, Page { free: true, texts, ..Page::default() });
        Some(id)
    }

    /// A page has gone.
    pub(crate) fn close(&self, page: PageId) {
        let mut inner = self.lock();
        inner.pages.remove(&page);
        // Nobody is there who could let time go on again.
        if inner.pages.is_empty() {
            (inner.pace, inner.picked) = (inner.usual, None);
        }
        drop(inner);
        self.wish.notify_all();
    }

    /// A page wants something.
    pub(crate) fn hear(&self, page: PageId, wish: Wish) {
        let mut inner = self.lock();
        let Inner { pages, pace, picked, .. } = &mut *inner;
        let Some(page) = pages.get_mut(&page) else { return };
        match wish {
            Wish::Look { view: [x0, y0, x1, y1], size, color } => {
                let view = super::super::picture::View { low: (x0, y0).into(), high: (x1, y1).into() };
                page.gaze = Some(Gaze { view, size, color });
                page.moved = true;
            }
            Wish::Ack { frame } => page.free |= frame == page.given,
            Wish::Play => pace.playing = true,
            Wish::Pause => pace.playing = false,
            Wish::Step { by } => (pace.playing, pace.by) = (false, pace.by.saturating_add(by.into())),
            Wish::Seek { step } => pace.seek = Some(step),
            Wish::Speed { times } => pace.times = times,
            Wish::Pick { source, at } => *picked = Some(Pick::At(source, at)),
            Wish::Drop => *picked = None,
        }
        self.wanted.store(true, Ordering::Relaxed);
        drop(inner);
        self.wish.notify_all();
    }

    /// What is ready for a page, once something is, or after so long.
    pub(crate) fn next(&self, page: PageId, patience: Duration) -> Ready {
        let waits = |inner: &mut Inner| {
            !inner.closed && inner.pages.get(&page).is_some_and(|page| page.texts.is_empty() && page.frame.is_none())
        };
        let (mut inner, _) =
            self.ready.wait_timeout_while(self.lock(), patience, waits).unwrap_or_else(PoisonError::into_inner);
        let closed = inner.closed;
        let Some(page) = inner.pages.get_mut(&page) else { return Ready::Closed };
        if !page.texts.is_empty() {
            Ready::Texts(std::mem::take(&mut page.texts))
        } else if let Some(frame) = page.frame.take() {
            Ready::Frame(frame)
        } else if closed {
            Ready::Closed
        } else {
            Ready::Nothing
        }
    }

    // What who shows the world does.

    /// Tells each page that comes from now on, first of all, and those that are there.
    pub(crate) fn greet(&self, greeting: Say) {
        self.tell(&greeting);
        self.lock().greeting = Some(greeting);
    }

    /// Tells all pages.
    pub(crate) fn tell(&self, say: &Say) {
        let mut inner = self.lock();
        for page in inner.pages.values_mut() {
            if page.texts.len() == MOST_TEXTS {
                page.texts.remove(0);
            }
            page.texts.push(text(say));
        }
        drop(inner);
        self.ready.notify_all();
    }

    /// Whether somebody may want something. Costs nothing.
    pub(crate) fn is_wanted(&self) -> bool {
        self.wanted.load(Ordering::Relaxed)
    }

    /// The frames that are due: of pages that have drawn their last one, a while ago, and either the world has changed, or they
    /// look elsewhere.
    pub(crate) fn due(&self, changed: bool) -> Vec<Due> {
        let mut inner = self.lock();
        let now = Instant::now();
        let rested = |page: &Page| page.last.is_none_or(|last| now - last >= FRAME);
        let mut due = Vec::new();
        for (&id, page) in &mut inner.pages {
            if let (Some(gaze), true) = (page.gaze, page.free && rested(page) && (changed || page.moved)) {
                due.push(Due { page: id, gaze, number: page.given.wrapping_add(1) });
            }
        }
        // Whoever draws now will want another.
        self.wanted.store(!inner.pages.is_empty(), Ordering::Relaxed);
        due
    }

    /// Gives a page its frame.
    pub(crate) fn give(&self, due: &Due, frame: Vec<u8>) {
        let mut inner = self.lock();
        if let Some(page) = inner.pages.get_mut(&due.page) {
            page.frame = Some(frame);
            page.given = due.number;
            page.free = false;
            page.moved &= page.gaze != Some(due.gaze);
            page.last = Some(Instant::now());
        }
        drop(inner);
        self.ready.notify_all();
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
        self.lock().pace.playing = false;
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

    /// Waits until somebody wants something, but no longer than `patience`.
    pub(crate) fn wait(&self, patience: Duration) {
        let inner = self.lock();
        drop(self.wish.wait_timeout(inner, patience));
    }

    /// Nothing more will be shown. Who waits for it is told.
    pub(crate) fn end(&self) {
        self.lock().closed = true;
        self.wish.notify_all();
        self.ready.notify_all();
    }
}

fn text(say: &Say) -> String {
    serde_json::to_string(say).expect("names, texts and numbers")
}

#[cfg(test)]
mod tests {
    use super::super::super::picture::ColorBy;
    use super::*;

    const NOW: Duration = Duration::ZERO;

    fn look(x: f64) -> Wish {
        Wish::Look { view: [x, 0.0, x + 1.0, 1.0], size: [4, 4], color: ColorBy::Kind }
    }

    /// Long enough for the next frame.
    fn rest() {
        std::thread::sleep(FRAME + Duration::from_millis(5));
    }

    #[test]
    fn a_page_gets_a_frame_once_it_has_drawn_the_last_or_looks_elsewhere() {
        let desk = Desk::new(true, 0.0);
        assert!(!desk.is_wanted() && desk.due(true).is_empty());
        let page = desk.open().unwrap();
        assert!(desk.due(true).is_empty(), "it looks at nothing yet");
        desk.hear(page, look(0.0));
        assert!(desk.is_wanted());
        let [due] = desk.due(false)[..] else { panic!("one page looks") };
        desk.give(&due, vec![1]);
        assert!(desk.due(true).is_empty(), "the first is not drawn");
        assert_eq!(desk.next(page, NOW), Ready::Frame(vec![1]));
        rest();
        assert!(desk.due(true).is_empty(), "nor is it now");
        desk.hear(page, Wish::Ack { frame: due.number });
        assert!(desk.due(false).is_empty(), "nothing has changed");
        desk.hear(page, look(1.0));
        assert_eq!(desk.due(false).len(), 1);
        assert_eq!(desk.due(true).len(), 1);
        desk.close(page);
        assert!(desk.due(true).is_empty() && !desk.is_wanted());
        assert_eq!(desk.next(page, NOW), Ready::Closed);
    }

    #[test]
    fn who_leaves_a_world_that_stands_still_lets_it_go_on() {
        let desk = Desk::new(true, 0.0);
        let (one, other) = (desk.open().unwrap(), desk.open().unwrap());
        desk.hear(one, Wish::Step { by: 2 });
        desk.hear(one, Wish::Speed { times: 0.5 });
        desk.hear(one, Wish::Pick { source: 0, at: [1.0, 2.0] });
        assert_eq!(desk.take_pace(), Pace { playing: false, times: 0.5, by: 2, seek: None });
        desk.close(one);
        assert_eq!(desk.take_pace(), Pace { playing: false, times: 0.5, by: 0, seek: None });
        assert_eq!(desk.picked(), Some(Pick::At(0, [1.0, 2.0])));
        desk.close(other);
        assert_eq!(desk.take_pace(), Pace { playing: true, times: 0.0, by: 0, seek: None });
        assert_eq!(desk.picked(), None);
    }

    #[test]
    fn there_is_room_for_so_many_pages_and_so_many_words() {
        let desk = Desk::new(true, 0.0);
        let pages: Vec<_> = std::iter::from_fn(|| desk.open()).collect();
        assert_eq!(pages.len(), MOST_PAGES);
        (0..1000).for_each(|i| desk.tell(&Say::Note { text: i.to_string() }));
        let Ready::Texts(texts) = desk.next(pages[0], NOW) else { panic!("much was said") };
        assert_eq!((texts.len(), texts.last().unwrap().as_str()), (MOST_TEXTS, r#"{"type":"note","text":"999"}"#));
        desk.end();
        assert_eq!(desk.next(pages[0], NOW), Ready::Closed);
        assert!(matches!(desk.next(pages[1], NOW), Ready::Texts(_)), "what was said before is");
        desk.close(pages[1]);
        assert_eq!(desk.open(), None);
    }
}
