//! Shows a run while it goes on: lets its ranks meet when a frame is due, asks them for their parts, and gives pages what comes
//! of them.

use super::desk::{Desk, Due, Pick};
use super::figures::Course;
use super::protocol::{Gaze, Picture, Say, Tiles};
use super::question::{Found, Question, answer, portion};
use super::sketch::{Paper, compose, rectangle};
use super::{figures, scenery};
use crate::folder::recording::RunFacts;
use crate::look::frame::Setting;
use crate::look::picture::{ColorBy, Range};
use crate::plan::Plan;
use crate::rank::{Held, Host, Next};
use bytemuck::Pod;
use glam::DVec2;
use std::collections::VecDeque;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

/// While time goes on, ranks draw for one part in so many of it, at most.
const SHARE: u32 = 16;
/// While time goes on, a frame that takes longer is followed by a coarser one, up to [`COARSEST`].
const QUICK: Duration = Duration::from_millis(4);
/// See [`QUICK`].
const COARSEST: u32 = 4;
/// Between two times that ranks tell how it goes, at least.
const TELL: Duration = Duration::from_millis(400);
/// How it goes costs one part in so many, at most.
const TELL_SHARE: u32 = 100;

/// See the head of this file. There is one in every process of a run; only that of rank 0 has pages.
#[derive(Debug)]
pub(crate) struct Viewer {
    /// What there is to see, but for the bodies.
    setting: Mutex<Arc<Setting>>,
    ranks: u32,
    last_step: u64,
    lingers: bool,
    desk: Option<Arc<Desk>>,
    /// By rank.
    papers: Vec<Mutex<Paper>>,
    state: Mutex<State>,
}

/// What is known of a body that was looked for: which, after so many steps, the rank that has it, and what that tells.
type Known = (Pick, u64, (u32, Found));

/// What rank 0 keeps in mind.
#[derive(Debug)]
struct State {
    /// What was asked last, and when.
    asked: Option<(Asked, Instant)>,
    /// How many bodies there are at the start.
    bodies: u64,
    /// Frames to be made.
    due: VecDeque<Due>,
    /// No frame is made before.
    next_frame: Instant,
    /// What such a frame is drawn with while time goes on.
    coarseness: u32,
    /// Whether there ever was one.
    begun: bool,
    /// Of speeds, and of spins.
    ranges: [Range; 2],
    /// What the ranges fit.
    measured: Option<(ColorBy, u64)>,
    /// The body that was looked for last, if it was found.
    found: Option<Known>,
    /// As pages know them.
    tiles: Tiles,
    course: Course,
    /// Nobody is asked how it goes before; and after how many steps somebody was.
    next_course: Instant,
    told: Option<u64>,
    /// When the next step is to be made, if not as soon as can be.
    next_step: Instant,
}

#[derive(Debug)]
enum Asked {
    Measure(ColorBy, u64),
    Look(Due),
    Find(Pick, u64),
    Figures(u64),
}

impl Viewer {
    /// Of a plan. Its ranks meet also before the first step, and stay after the last, if it `lingers`.
    pub(crate) fn new(plan: &Plan, desk: Option<Arc<Desk>>, lingers: bool, name: &str) -> Self {
        let blueprint = plan.blueprint.clone();
        let facts = RunFacts::new(&plan.config, plan.scene.domain(), plan.tiles, 1);
        let hertz = facts.hertz().expect("every configuration has a frequency");
        let (partition, kinds, statics) = (blueprint.partition, blueprint.kinds, blueprint.statics);
        let ranks_of_tiles = plan.assignment.ranks_of_tiles().to_vec();
        let names = plan.kind_names().to_vec();
        let setting = Setting { partition, kinds, names, statics, hertz };
        let last_step = plan.config.run.steps;
        if let Some(desk) = &desk {
            let source = scenery::source(name.to_owned(), &setting, ranks_of_tiles.clone());
            desk.greet(Say::Hello(scenery::hello(vec![source], false, Vec::new(), last_step)));
        }
        let now = Instant::now();
        let state = State {
            asked: None,
            bodies: plan.scene.bodies(),
            due: VecDeque::new(),
            next_frame: now,
            coarseness: 1,
            begun: false,
            ranges: [Range::default(); 2],
            measured: None,
            found: None,
            tiles: Tiles::new(&setting.partition, ranks_of_tiles),
            course: Course::default(),
            next_course: now,
            told: None,
            next_step: now,
        };
        let ranks = plan.assignment.ranks();
        let papers = (0..ranks).map(|_| Mutex::default()).collect();
        let setting = Mutex::new(Arc::new(setting));
        Self { setting, ranks: ranks as u32, last_step, lingers, desk, papers, state: Mutex::new(state) }
    }

    /// Gives a page its frame. Returns what that cost, on the slowest rank: ranks that wait for each other in a meeting need not do
    /// so after it.
    fn give(&self, desk: &Desk, state: &mut State, due: &Due, answers: &[Vec<u8>]) -> Duration {
        let (begun, setting) = (Instant::now(), self.setting());
        let parts: Vec<_> = answers.iter().filter_map(|answer| portion(answer)).collect();
        let (pixels, image) = compose(parts.iter().map(|part| (part.pixels, part.density)));
        let dots: Vec<&[u8]> = parts.iter().map(|part| part.dots).collect();
        let found = state.found.map(|(.., (_, found))| DVec2::from(found.place));
        let picture = Picture {
            source: 0,
            number: due.number,
            step: due.version,
            time: due.version as f64 / setting.hertz,
            rectangle: rectangle(&setting, &due.gaze),
            density: due.gaze.part(pixels),
            picked: found,
            legend: &scenery::legend(due.gaze.color, &setting, self.ranks, state.range(due.gaze.color)),
            pixels: &image,
            dots: &dots,
        };
        desk.give(due, vec![picture.encode()]);
        state.begun = true;
        parts.iter().map(|part| part.took).max().unwrap_or_default() + begun.elapsed()
    }

    /// Tells pages if tiles are others, or held by others, than they know.
    fn tell_of_tiles(&self, desk: &Desk, held: &Held<'_>) {
        let now = Tiles::new(held.world.partition(), held.assignment.ranks_of_tiles().to_vec());
        let mut state = lock(&self.state);
        if state.tiles != now {
            state.tiles = now;
            desk.greet(Say::Tiles { worlds: vec![state.tiles.clone()] });
        }
    }

    fn setting(&self) -> Arc<Setting> {
        Arc::clone(&lock(&self.setting))
    }

    /// Knows the kinds that a world has by now, and tells pages of new ones.
    fn follow_kinds(&self, world: &atoll_core::World) {
        let mut setting = lock(&self.setting);
        if setting.kinds.len() != world.kinds().len() {
            *setting = Arc::new(Setting { kinds: world.kinds().collect(), ..(**setting).clone() });
            if let Some(desk) = &self.desk {
                desk.greet(Say::Shapes { shapes: scenery::shapes(&setting) });
            }
        }
    }

    /// Tells pages of the body that was looked for.
    fn tell_found(&self, desk: &Desk, pick: Pick, found: Option<(u32, Found)>) {
        let body = found.map(|(rank, found)| scenery::picked(&found, 0, &self.setting(), rank, true));
        desk.found(pick, found.map(|(_, found)| Pick::Body(0, found.id)));
        desk.tell(&Say::Body { body });
    }
}

impl State {
    fn range(&self, by: ColorBy) -> Range {
        self.ranges[usize::from(by == ColorBy::Spin)]
    }

    /// What to ask next.
    fn question(&mut self, desk: &Desk, steps: u64, is_still: bool) -> Option<Question> {
        let now = Instant::now();
        if self.due.is_empty() && (is_still || now >= self.next_frame) {
            self.due.extend(desk.due(steps));
        }
        let (asked, question) = match (self.next_to_find(desk, steps), self.due.front()) {
            (Some(pick), _) => {
                let question = match pick {
                    Pick::At(_, place, reach) => Question::Find(None, place, reach),
                    Pick::Body(_, id) => Question::Find(Some(id), [0.0; 2], 0.0),
                };
                (Asked::Find(pick, steps), question)
            }
            (None, Some(due)) if due.gaze.color.is_measured() && self.measured != Some((due.gaze.color, steps)) => {
                (Asked::Measure(due.gaze.color, steps), Question::Measure(due.gaze.color))
            }
            (None, Some(&due)) => {
                self.due.pop_front();
                let most = self.range(due.gaze.color).most;
                let coarseness = if is_still || due.glimpsed { 1 } else { self.coarseness };
                let gaze = Gaze { coarseness, ..due.gaze };
                (Asked::Look(Due { version: steps, gaze, ..due }), Question::Look { gaze, most, bodies: self.bodies })
            }
            (None, None) if desk.is_wanted() && self.is_to_tell(steps) => (Asked::Figures(steps), Question::Figures),
            (None, None) => return None,
        };
        self.asked = Some((asked, now));
        Some(question)
    }

    /// The body to look for: one that somebody has just pointed at, or, when a frame is made, where one is now.
    fn next_to_find(&mut self, desk: &Desk, steps: u64) -> Option<Pick> {
        let picked = desk.picked();
        let Some(pick) = picked else {
            if self.found.take().is_some() {
                desk.tell(&Say::Body { body: None });
            }
            return None;
        };
        let is_known = |(of, at, _): &Known| *of == pick && (*at == steps || self.due.is_empty());
        (!self.found.as_ref().is_some_and(is_known)).then_some(pick)
    }

    /// Whether pages are to be told how it goes, and have not been told just that.
    fn is_to_tell(&self, steps: u64) -> bool {
        Instant::now() >= self.next_course && self.told != Some(steps)
    }
}

impl Host for Viewer {
    fn calls(&self, steps: u64) -> bool {
        let Some(desk) = &self.desk else { return false };
        if !desk.is_wanted() {
            return desk.pace().times > 0.0;
        }
        let (pace, state) = (desk.pace(), lock(&self.state));
        desk.has_commands()
            || !pace.playing
            || pace.times > 0.0
            || pace.by != 0
            || state.is_to_tell(steps)
            || desk.picked() != state.found.map(|(pick, ..)| pick)
            || Instant::now() >= state.next_frame && desk.rests(steps).is_some_and(|rest| rest.is_zero())
    }

    fn next(&self, steps: u64, patience: Duration) -> Next {
        // Without pages nothing holds ranks up.
        let Some(desk) = &self.desk else { return Next::GoOn };
        let mut state = lock(&self.state);
        let (wishes, pace) = (desk.wishes(), desk.pace());
        let is_over = steps >= self.last_step;
        let is_still = !pace.playing || is_over;
        if let Some(lines) = desk.take_commands(steps) {
            return Next::Do(lines);
        }
        if let Some(question) = state.question(desk, steps, is_still) {
            return Next::Ask(serde_json::to_vec(&question).expect("numbers and names"));
        }
        if is_over && !self.lingers {
            return Next::GoOn;
        }
        let now = Instant::now();
        let until = match (is_over, pace) {
            (true, _) => None,
            // The first page is to see it from the start.
            _ if self.lingers && !state.begun => None,
            (_, pace) if pace.by > 0 => {
                desk.made_one();
                return Next::GoOn;
            }
            (_, pace) if !pace.playing => None,
            (_, pace) if pace.times == 0.0 => return Next::GoOn,
            (_, pace) => {
                let step = Duration::from_secs_f64((1.0 / (self.setting().hertz * pace.times)).min(1e6));
                if now >= state.next_step {
                    // What is late by a little is caught up with.
                    state.next_step = state.next_step.max(now - 2 * step.min(TELL)) + step;
                    return Next::GoOn;
                }
                state.next_step = state.next_step.min(now + step);
                Some(state.next_step - now)
            }
        };
        let course =
            (state.told != Some(steps) && desk.is_wanted()).then(|| state.next_course.saturating_duration_since(now));
        drop(state);
        let waits = [until, desk.rests(steps), course].into_iter().flatten();
        desk.wait(wishes, waits.fold(patience, Duration::min).max(Duration::from_micros(200)));
        Next::Wait
    }

    fn answer(&self, question: &[u8], held: &Held<'_>) -> Vec<u8> {
        if let Some(desk) = &self.desk {
            self.tell_of_tiles(desk, held);
        }
        self.follow_kinds(held.world);
        match (serde_json::from_slice(question), self.papers.get(held.rank.index())) {
            (Ok(question), Some(paper)) => answer(&question, &self.setting(), held, &mut lock(paper)),
            // It is of another version; that is found out before.
            _ => Vec::new(),
        }
    }

    fn hear(&self, answers: Vec<Vec<u8>>) {
        let mut state = lock(&self.state);
        let (Some(desk), Some((asked, since))) = (&self.desk, state.asked.take()) else { return };
        match asked {
            Asked::Measure(by, steps) => {
                let mut values = all(&answers);
                state.ranges[usize::from(by == ColorBy::Spin)].grow_to(&mut values);
                state.measured = Some((by, steps));
            }
            Asked::Look(due) => {
                let took = self.give(desk, &mut state, &due, &answers);
                state.next_frame = Instant::now() + (SHARE - 1) * took;
                state.coarseness = suited(due.gaze.coarseness, took);
            }
            Asked::Find(pick, steps) => {
                let found = (0..).zip(&answers).filter_map(|(rank, answer)| Some((rank, *all(slice(answer)).first()?)));
                let found = found.min_by(|(_, a): &(u32, Found), (_, b)| a.distance.total_cmp(&b.distance));
                self.tell_found(desk, pick, found);
                let known = found.map_or(pick, |(_, found)| Pick::Body(0, found.id));
                state.found = found.map(|found| (known, steps, found));
            }
            Asked::Figures(steps) => {
                let said = state.course.say(all::<figures::Part>(&answers));
                desk.tell(&said);
                state.told = Some(steps);
                state.next_course = Instant::now() + TELL.max(TELL_SHARE * since.elapsed());
            }
        }
    }

    fn note(&self, text: &str) {
        if let Some(desk) = &self.desk {
            desk.tell(&Say::Note { text: text.to_owned() });
        }
    }

    fn fail(&self, why: &str) {
        if let Some(desk) = &self.desk {
            desk.greet(Say::Failed { why: why.to_owned() });
        }
    }

    fn lingers(&self) -> bool {
        self.lingers
    }
}

/// How coarse the next frame is to be after one that took so long. Twice as coarse is up to four times as quick.
fn suited(coarseness: u32, took: Duration) -> u32 {
    if took > QUICK {
        (2 * coarseness).min(COARSEST)
    } else if 5 * took < QUICK {
        (coarseness / 2).max(1)
    } else {
        coarseness
    }
}

fn slice<T>(one: &T) -> &[T] {
    std::slice::from_ref(one)
}

/// What came from all ranks, as one list.
fn all<T: Pod>(answers: &[Vec<u8>]) -> Vec<T> {
    let parts = answers.iter().flat_map(|answer| answer.chunks_exact(size_of::<T>()));
    parts.map(bytemuck::pod_read_unaligned).collect()
}

fn lock<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}
