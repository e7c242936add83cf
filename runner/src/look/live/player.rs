//! Plays what runs have recorded, one or two of them on one clock.

use super::desk::{Desk, Due, Pace, Pick};
use super::protocol::{Gaze, Picture, Say, Source, Tiles};
use super::question::{Found, distance};
use super::sketch::{Paper, Portion, Sketch, rectangle, turn_of_angle};
use super::{figures, scenery};
use crate::folder::recording::{RecordingError, Row};
use crate::look::compare;
use crate::look::frame::{Frame, Setting};
use crate::look::picture::{ColorBy, Range, Rgb, Tint};
use crate::look::recorded::Recorded;
use crate::rank::StopFlag;
use atoll_core::{Body, GlobalId, KindId, Region, Rot};
use glam::{DVec2, Vec2};
use std::iter::Empty;
use std::sync::Arc;
use std::thread;
use std::time::{Duration, Instant};

/// How long nothing may happen before is looked whether to stop.
const PATIENCE: Duration = Duration::from_millis(100);

/// A recording, and the record of it that is shown.
#[derive(Debug)]
struct Track {
    recorded: Recorded,
    /// The steps of what is shown: each at the same time as that of every other recording.
    steps: Vec<u64>,
    frame: Frame,
    ranges: [Range; 2],
}

/// Shows recordings to pages until somebody asks to stop.
#[derive(Debug)]
pub(crate) struct Player {
    tracks: Vec<Track>,
    desk: Arc<Desk>,
    /// Where time is, in steps of the first; between two records the earlier is shown.
    time: f64,
    /// Which records the frames hold.
    shown: Option<usize>,
    /// Of each world, as pages know them.
    tiles: Vec<Tiles>,
    /// The body that pages were told of, and after which step.
    told: Option<(Pick, u64)>,
    found: Option<(usize, Found)>,
    paper: Paper,
}

impl Player {
    /// Of recordings, each with a name. None if they have no time in common.
    pub(crate) fn new(recorded: Vec<(String, Recorded)>, desk: Arc<Desk>) -> Option<Self> {
        let mut tracks = Vec::new();
        let mut sources = Vec::new();
        let together = {
            let records = recorded.iter().map(|(_, of)| (of.setting().hertz, of.recording().steps()));
            at_same_times(&records.collect::<Vec<_>>())
        };
        for ((name, recorded), steps) in recorded.into_iter().zip(together) {
            let records = recorded.recording().steps().len();
            sources.push(Source { records, ..scenery::source(name, recorded.setting(), Vec::new()) });
            tracks.push(Track { recorded, steps, frame: Frame::default(), ranges: [Range::default(); 2] });
        }
        let common = tracks.first()?.steps.clone();
        let (&first, &last) = common.first().zip(common.last())?;
        desk.greet(Say::Hello(scenery::hello(sources, true, common, last)));
        Some(Self {
            tracks,
            desk,
            time: first as f64,
            shown: None,
            tiles: Vec::new(),
            told: None,
            found: None,
            paper: Paper::default(),
        })
    }

    /// Shows them.
    ///
    /// # Errors
    /// If a record cannot be read.
    pub(crate) fn play(mut self, stop: &StopFlag) -> Result<(), RecordingError> {
        thread::scope(|scope| {
            let (desk, ended) = (Arc::clone(&self.desk), StopFlag::default());
            if let [one, other] = &self.tracks[..]
                && one.hertz() == other.hertz()
            {
                let folders = [one, other].map(|track| track.recorded.recording().folder().to_owned());
                let (stop, ended) = (stop.clone(), ended.clone());
                let find = move || {
                    let is_over = || stop.is_requested() || ended.is_requested();
                    // What cannot be read is complained of where it is shown.
                    if let Ok(Some(step)) = compare::first_step_apart(&folders[0], &folders[1], is_over) {
                        desk.greet(Say::Difference { step });
                    }
                };
                // Without it, nothing is marked.
                let _ = thread::Builder::new().name("differences".to_owned()).spawn_scoped(scope, find);
            }
            let played = self.go_on(stop);
            ended.request();
            played.inspect_err(|error| self.desk.greet(Say::Failed { why: error.to_string() }))
        })
    }

    fn go_on(&mut self, stop: &StopFlag) -> Result<(), RecordingError> {
        let mut last = Instant::now();
        while !stop.is_requested() {
            let (wishes, pace, now) = (self.desk.wishes(), self.desk.take_pace(), Instant::now());
            let patience = self.advance(&pace, now - last);
            last = now;
            let due = self.desk.due(self.step());
            if !due.is_empty() {
                self.show(&due)?;
            }
            self.look_for_picked()?;
            if !due.is_empty() {
                self.tell();
            }
            let waits = [patience, self.desk.rests(self.step())].into_iter().flatten();
            self.desk.wait(wishes, waits.fold(PATIENCE, Duration::min));
        }
        Ok(())
    }

    /// The index of the record that is shown.
    fn index(&self) -> usize {
        self.steps().partition_point(|step| *step as f64 <= self.time + 1e-6).max(1) - 1
    }

    /// Those of the first.
    fn steps(&self) -> &[u64] {
        &self.tracks[0].steps
    }

    fn step(&self) -> u64 {
        self.steps()[self.index()]
    }

    /// Lets time pass, and says how long it is until the next record, if time goes on.
    fn advance(&mut self, pace: &Pace, passed: Duration) -> Option<Duration> {
        let last = self.steps().len() - 1;
        if let Some(step) = pace.seek {
            self.time = (step as f64).clamp(self.steps()[0] as f64, self.steps()[last] as f64);
        }
        if pace.by != 0 {
            let index = (self.index() as i64).saturating_add(pace.by).clamp(0, last as i64) as usize;
            self.time = self.steps()[index] as f64;
        }
        // Nobody is to miss the beginning.
        if !pace.playing || !self.desk.is_wanted() || self.shown.is_none() {
            return None;
        }
        let hertz = self.tracks[0].hertz();
        if pace.times > 0.0 {
            self.time += passed.as_secs_f64() * hertz * pace.times;
        } else if pace.seek.is_none() && self.desk.rests(u64::MAX).is_some_and(|rest| rest.is_zero()) {
            self.time = self.steps()[(self.index() + 1).min(last)] as f64;
        }
        let Some(&next) = self.steps().get(self.index() + 1) else {
            self.time = self.steps()[last] as f64;
            self.desk.pause();
            return None;
        };
        let left = (next as f64 - self.time) / (hertz * if pace.times > 0.0 { pace.times } else { 1e3 });
        Some(Duration::from_secs_f64(left.clamp(0.001, 60.0)))
    }

    /// Reads the records that are to be shown.
    fn read(&mut self) -> Result<(), RecordingError> {
        let index = self.index();
        if self.shown != Some(index) {
            for track in &mut self.tracks {
                track.recorded.read(track.steps[index], &mut track.frame)?;
            }
            self.shown = Some(index);
            if self.tracks.iter().any(|track| track.frame.tiling.is_some()) {
                self.tell_of_tiles();
            }
        }
        Ok(())
    }

    /// Tells pages of the tiles of this step. Which rank holds which is not recorded.
    fn tell_of_tiles(&mut self) {
        let partition = |track: &Track| Tiles::new(track.frame.partition(track.recorded.setting()), Vec::new());
        let worlds: Vec<Tiles> = self.tracks.iter().map(partition).collect();
        if self.tiles != worlds {
            self.tiles.clone_from(&worlds);
            self.desk.greet(Say::Tiles { worlds });
        }
    }

    fn show(&mut self, due: &[Due]) -> Result<(), RecordingError> {
        self.read()?;
        self.look_for_picked()?;
        for due in due {
            let frames = (0..self.tracks.len()).map(|source| self.draw(source, due)).collect();
            self.desk.give(due, frames);
        }
        Ok(())
    }

    fn draw(&mut self, source: usize, due: &Due) -> Vec<u8> {
        let track = &mut self.tracks[source];
        let by = due.gaze.color;
        let range = &mut track.ranges[usize::from(by == ColorBy::Spin)];
        range.grow(by, &track.frame);
        let range = *range;
        let (setting, frame) = (track.recorded.setting(), &track.frame);
        let Portion { pixels, density, dots } = draw(&mut self.paper, setting, frame, &due.gaze, range);
        let ranks = frame.ranks.last().map_or(1, |(rank, _)| rank + 1);
        let legend = scenery::legend(by, setting, ranks, range);
        let place = |(_, found): (usize, Found)| DVec2::from(found.place);
        let picture = Picture {
            source: source as u32,
            number: due.number,
            step: frame.step,
            time: frame.step as f64 / setting.hertz,
            rectangle: rectangle(setting, &due.gaze),
            density: due.gaze.part(if density.is_empty() { [[0; 2]; 2] } else { pixels }),
            picked: self.found.filter(|(of, _)| *of == source).map(place),
            legend: &legend,
            pixels: &density,
            dots: &[bytemuck::cast_slice(&dots)],
        };
        picture.encode()
    }

    /// Finds the body that somebody wants to know about, where it is now.
    fn look_for_picked(&mut self) -> Result<(), RecordingError> {
        let (picked, step) = (self.desk.picked(), self.step());
        if picked.map(|pick| (pick, step)) == self.told {
            return Ok(());
        }
        let Some(pick) = picked else {
            (self.told, self.found) = (None, None);
            self.desk.tell(&Say::Body { body: None });
            return Ok(());
        };
        self.read()?;
        let (Pick::At(source, ..) | Pick::Body(source, _)) = pick;
        let found = self.tracks.get(source as usize).and_then(|track| track.find(pick));
        let body = found.map(|(found, rank)| {
            scenery::picked(&found, source, self.tracks[source as usize].recorded.setting(), rank, false)
        });
        self.desk.tell(&Say::Body { body });
        let now = found.map(|(found, _)| Pick::Body(source, found.id));
        self.desk.found(pick, now);
        self.told = now.map(|pick| (pick, step));
        self.found = found.map(|(found, _)| (source as usize, found));
        Ok(())
    }

    /// Tells pages how it goes.
    fn tell(&self) {
        let hertz = self.tracks[0].hertz();
        let mut all = vec![("record", format!("{} of {}", self.index() + 1, self.steps().len()))];
        if let (Some(first), Some(last)) = (self.steps().first(), self.steps().last()) {
            all.push(("recorded", format!("{} s", figures::digits((last - first) as f64 / hertz))));
        }
        let bodies = |track: &Track| track.frame.bodies.len();
        let counts: Vec<_> = self.tracks.iter().map(|track| crate::look::picture::grouped(bodies(track))).collect();
        all.push(("bodies", counts.join(", ")));
        self.desk.tell(&Say::Figures { figures: all, phases: Vec::new(), busy: Vec::new() });
    }
}

/// Draws a frame that nobody sees.
pub(super) fn draw_once(setting: &Setting, frame: &Frame, gaze: Gaze) {
    let Portion { density, .. } = draw(&mut Paper::default(), setting, frame, &gaze, Range::default());
    assert!(density.len() <= 4 * (gaze.size[0] * gaze.size[1]) as usize);
}

/// Draws a record.
fn draw(paper: &mut Paper, setting: &Setting, frame: &Frame, gaze: &Gaze, range: Range) -> Portion {
    let mut sketch = Sketch::new(paper, setting, gaze, frame.bodies.len(), None::<Empty<Region>>);
    let (by, tint) = (gaze.color, Tint::new(gaze.color, range));
    let kinds: Vec<Rgb> = (0..setting.kinds.len() as u32).map(Tint::numbered).collect();
    let (mut from, partition) = (0, frame.partition(setting));
    for &(rank, to) in &frame.ranks {
        let of_rank = Tint::numbered(rank);
        for row in &frame.bodies[from..to] {
            let place = DVec2::new(row.x, row.y);
            let color = || match by {
                ColorBy::Kind => kinds.get(row.kind as usize).copied().unwrap_or(Tint::asleep(None)),
                ColorBy::Speed | ColorBy::Spin => tint.moving(row.vx, row.vy, row.omega),
                ColorBy::Tile => Tint::tile(partition.locate(place), partition),
                ColorBy::Rank => of_rank,
                // No recording tells.
                ColorBy::Contacts | ColorBy::Asleep => Tint::asleep(None),
            };
            sketch.add(place, row.kind, || turn_of_angle(row.angle), color);
        }
        from = to;
    }
    sketch.finish()
}

/// Of recordings with steps of so many a second, each of which has records of some: the steps of those records that all others have one at the
/// same time as, as many for each.
fn at_same_times(recordings: &[(f64, &[u64])]) -> Vec<Vec<u64>> {
    let Some(&(first, steps)) = recordings.first() else { return Vec::new() };
    let mut all = vec![Vec::new(); recordings.len()];
    for &step in steps {
        let at_the_time = |&(hertz, steps): &(f64, &[u64])| {
            let exact = step as f64 * (hertz / first);
            let near = exact.round();
            ((exact - near).abs() <= 1e-6 && steps.binary_search(&(near as u64)).is_ok()).then_some(near as u64)
        };
        let each: Option<Vec<u64>> = recordings.iter().map(at_the_time).collect();
        each.into_iter().flatten().zip(&mut all).for_each(|(step, of)| of.push(step));
    }
    all
}

impl Track {
    fn hertz(&self) -> f64 {
        self.recorded.setting().hertz
    }

    /// A body, and the rank that has it.
    fn find(&self, pick: Pick) -> Option<(Found, u32)> {
        let (setting, frame) = (self.recorded.setting(), &self.frame);
        let distance = |row: &Row| match pick {
            Pick::Body(_, id) => (row.id == id).then_some(f64::NEG_INFINITY),
            Pick::At(_, place, reach) => {
                let shape = &setting.kinds.get(row.kind as usize)?.shape;
                let place = DVec2::from(place);
                let near = reach + f64::from(shape.bounding_radius());
                let is_near = (place - DVec2::new(row.x, row.y)).abs().max_element() <= near;
                is_near.then(|| distance(shape, &body(row), place)).filter(|distance| *distance <= reach)
            }
        };
        let near = frame.bodies.iter().enumerate().filter_map(|(i, row)| Some((distance(row)?, i)));
        let (_, i) = near.min_by(|a, b| a.0.total_cmp(&b.0))?;
        let row = &frame.bodies[i];
        let tile = frame.partition(setting).locate(DVec2::new(row.x, row.y)).0;
        let rank = frame.ranks.get(frame.ranks.partition_point(|(_, end)| *end <= i)).map_or(0, |(rank, _)| *rank);
        Some((Found { tile, angle: row.angle, ..Found::of(&body(row)) }, rank))
    }
}

/// A body as it was recorded.
fn body(row: &Row) -> Body {
    Body {
        id: GlobalId(row.id),
        kind: KindId(row.kind),
        position: DVec2::new(row.x, row.y),
        rotation: Rot::from_angle(row.angle),
        velocity: Vec2::new(row.vx, row.vy),
        angular_velocity: row.omega,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn records_are_shown_together_that_are_of_one_time() {
        let (some, all, thirds) = ([0, 6, 8, 12], [0, 1, 2, 3, 4, 5, 6], [0, 3, 4, 6, 8, 100]);
        assert_eq!(at_same_times(&[(60.0, &some[..]), (60.0, &thirds[..])]), [[0, 6, 8], [0, 6, 8]]);
        assert_eq!(at_same_times(&[(60.0, &some[..]), (30.0, &all[..])]), [[0, 6, 8, 12], [0, 3, 4, 6]]);
        assert_eq!(at_same_times(&[(30.0, &all[..]), (20.0, &thirds[..])]), [[0, 6], [0, 4]]);
        assert_eq!(at_same_times(&[(60.0, &some[..])]), [some]);
        assert_eq!(at_same_times(&[(60.0, &[1][..]), (59.0, &[1][..])]), [[0_u64; 0]; 2]);
    }
}
