//! What is done to a world between two steps, and asked of it: all ranks take the same lines in the same order, and whether one can
//! be done depends on the whole world, of which they tell each other beforehand.

mod events;
mod kept;
mod presence;
mod rehearsal;

use super::halo::RankHalo;
use super::trouble::all_well;
use super::{Observer, RankError, unreadable};
use crate::command::{Action, Answer, Event, Line, NO_UNTIL, Part, Question, State, Word, named, word};
use crate::error::{Exit, RunError};
use crate::folder::AnswersFile;
use crate::plan::Plan;
use crate::wording::{OneLine, Typed};
use atoll_core::{Command, GlobalId, World};
use atoll_transport::{Collective, Counting, Rank, Stats, Transport};
use events::Followed;
use kept::Kept;
use presence::{Crowds, acts, find, next_name};
pub(crate) use rehearsal::check_commands;
use std::collections::BTreeSet;
use std::io;
use std::time::{Duration, Instant};

/// Sees to it that commands are done and questions answered.
pub(super) struct Commander {
    rank: Rank,
    /// What is planned and not done yet begins here.
    next: usize,
    lines: Vec<Line>,
    /// What these are called in errors.
    source: String,
    /// Whether whatever cannot be done is left out.
    skips: bool,
    /// Whether only pages have something to say while it runs: then nothing of it ends the run.
    is_page: bool,
    /// The last step there is to make.
    steps: u64,
    state: State,
    /// Whether anything was ever done.
    is_used: bool,
    /// Of the rank that speaks, where somebody wants them.
    answers: Option<AnswersFile>,
    /// Of one rank of a run that has a folder.
    kept: Option<Kept>,
    /// What the folder tells of what was done before, where it is not so.
    disagreement: Option<String>,
    /// Of the lines of a turn, the places of those that were refused.
    refused: BTreeSet<usize>,
    /// How to go on with a run that ends too early, if it can be.
    remedy: String,
    /// What was refused and ends the run.
    refusal: Option<String>,
    /// What there was after the last step of what is told.
    followed: Followed,
    /// What the scene calls its kinds.
    names: Vec<Option<String>>,
    crowds: Crowds,
    failure: Option<RunError>,
    /// How many lines of the step from which the run goes on were done before; until that is said.
    done_before: u64,
    /// How long all of this took this rank, and what ranks sent each other for it.
    pub(super) time: Duration,
    pub(super) sent: Stats,
}

/// What the words of whoever drives a run are called in errors.
const LIVE: &str = "what was said";
/// How to go on without what was refused.
const MEND: &str = "mend it, or leave out what cannot be done by --skip-refused";

fn lines_are(count: usize) -> String {
    if count == 1 { "1 line is".to_owned() } else { format!("{count} lines are") }
}

/// Tells of lines for steps that were not made.
fn note_not_made(source: &str, lines: usize, first: u64, observer: &Observer) {
    observer.note(&format!("{source}: {} for steps from {first} on, which were not made", lines_are(lines)));
}

/// Where a line stands. What pages say has no numbers.
fn place(source: &str, number: u64) -> String {
    if number == 0 { "a hand on the page".to_owned() } else { format!("{source}: line {number}") }
}

/// A line of this number and name that is not done before the step after `step`, and why.
fn refusal(source: &str, (line, name): (u64, Option<&str>), step: u64, reason: &str) -> String {
    let called = name.map_or(String::new(), |name| format!(" (\"{}\")", OneLine(name)));
    format!("{}{called}: step {step}: {}", place(source, line), OneLine(reason))
}

impl Commander {
    /// For a rank that begins, or goes on from the snapshot of the step `resumed`, which had this `state`. Nothing is written yet.
    ///
    /// # Errors
    /// If the run goes on, and what is to be done before its next step cannot be: then its folder is left as it is.
    pub(super) fn start(
        plan: &Plan,
        rank: Rank,
        (resumed, state): (Option<u64>, Option<State>),
        world: &World,
        transport: &mut impl Transport,
    ) -> Result<Self, RankError> {
        let commands = &plan.commands;
        let from = resumed.unwrap_or(0);
        let is_used = state.is_some();
        let mut state = match state {
            Some(state) => state,
            None => State::new(next_name(plan, world, transport)?),
        };
        let done_before = state.done;
        let [before, to_come] = commands.parted(from, done_before);
        let folder = plan.output.as_ref().map(|output| &output.folder);
        let known = before.map_or(0, |(_, lines)| lines.len());
        // From here on the folder has those that it knows of.
        let done = std::mem::replace(&mut state.lines, known as u64);
        let disagreement = folder.zip(resumed).and_then(|(folder, _)| kept::disagreement(folder, known as u64, done));
        let mut commander = Self {
            rank,
            next: 0,
            lines: to_come.map_or(Vec::new(), |(_, lines)| lines.to_vec()),
            source: to_come.map_or(String::new(), |(script, _)| script.path.display().to_string()),
            skips: commands.skips,
            is_page: !commands.drives,
            steps: plan.config.run.steps,
            state,
            is_used,
            answers: None,
            kept: folder.filter(|_| rank == Rank(0)).map(|folder| Kept::new(folder.clone(), known)),
            disagreement,
            refused: BTreeSet::new(),
            remedy: folder.map_or(String::new(), |folder| {
                let path = Typed(folder.path());
                format!("; to go on without it, or with --commands and what was mended: `atoll run --resume {path}`")
            }),
            refusal: None,
            followed: Followed::default(),
            names: plan.kind_names().to_vec(),
            crowds: Crowds::default(),
            failure: None,
            done_before,
            time: Duration::ZERO,
            sent: Stats::default(),
        };
        if plan.output.as_ref().is_some_and(|output| !output.begins) {
            commander.rehearse(plan, world, transport)?;
        }
        for event in Event::ALL {
            commander.followed.set(event, commander.state.tells(event), world, transport)?;
            commander.followed.go_back(event, commander.state.since(event), rank);
        }
        Ok(commander)
    }

    /// Whether what is planned before the next step can be done.
    ///
    /// # Errors
    /// If not, and it is not to be left out.
    fn rehearse(&self, plan: &Plan, world: &World, transport: &mut impl Transport) -> Result<(), RankError> {
        let step = world.step_count();
        let lines = &self.lines[..self.lines.partition_point(|line| line.step <= step)];
        if self.skips || step >= self.steps || lines.is_empty() {
            return Ok(());
        }
        let present = find(lines, world, transport)?;
        let rehearsed = rehearsal::rehearse(plan, lines, present, self.state.clone()).map_err(RankError::Setup)?;
        rehearsed.map_err(|(line, reason)| {
            let text = refusal(&self.source, (line.number, line.name.as_deref()), step, &reason);
            RankError::Agreed { text: format!("{text}; {MEND}"), exit: Exit::Usage }
        })
    }

    /// Opens what one rank writes, and says what comes too late.
    ///
    /// # Errors
    /// If what is done or answered cannot be written down.
    pub(super) fn open(
        &mut self,
        plan: &Plan,
        from: u64,
        observer: &Observer,
        transport: &mut impl Transport,
    ) -> Result<(), RankError> {
        let opened = if self.rank == Rank(0) { self.open_files(plan, from) } else { Ok(()) };
        all_well(transport, opened.as_ref().err())?;
        let late = if self.rank == Rank(0) { plan.commands.late(from, self.done_before) } else { 0 };
        if late > 0 {
            let lines = lines_are(late);
            observer.note(&format!("{}: {lines} for steps before {from}, which are made; left out", self.source));
        }
        if let (Rank(0), Some(text)) = (self.rank, &self.disagreement) {
            observer.note(text);
        }
        Ok(())
    }

    fn open_files(&mut self, plan: &Plan, from: u64) -> Result<(), RunError> {
        if let Some(path) = &plan.commands.answers {
            let opened = AnswersFile::open(path, from, self.done_before > 0);
            self.answers = Some(opened.map_err(|error| not_opened(path, &error))?);
        }
        let Some(output) = &plan.output else { return Ok(()) };
        let written = output.folder.write_commands(&plan.commands.record(from, self.done_before));
        written.map_err(|error| not_written(&output.folder.commands(), &error))
    }

    /// Before a snapshot in the midst of what is done before a step: notes which events are not told yet.
    ///
    /// # Errors
    /// If a rank is lost.
    pub(super) fn pause<T: Transport>(&mut self, world: &World, transport: &mut Counting<T>) -> Result<(), RankError> {
        if self.state.done > 0 {
            let (begun, sent) = (Instant::now(), transport.stats());
            for event in Event::ALL {
                *self.state.since(event) = self.followed.since(event, world, transport)?;
            }
            self.time += begun.elapsed();
            self.sent += transport.stats().since(&sent);
        }
        Ok(())
    }

    /// What a snapshot is to tell of it, if there is anything.
    pub(super) fn state(&self) -> Option<&State> {
        (self.is_used || self.state.lines > 0).then_some(&self.state)
    }

    /// Whether something was refused that ends the run.
    pub(super) fn is_over(&self) -> bool {
        self.refusal.is_some()
    }

    /// What was refused and ends the run, if something was, on all ranks alike.
    pub(super) fn refusal(&mut self) -> Option<RankError> {
        self.refusal.take().map(|text| RankError::Agreed { text, exit: Exit::Usage })
    }

    /// How many more bodies there are to be than at the start.
    pub(super) fn added(&self) -> i64 {
        self.state.added
    }

    /// Why the run cannot go on as it was asked to, if something could not be written.
    pub(super) fn failure(&self) -> Option<&RunError> {
        self.failure.as_ref()
    }

    /// Once no more steps are made: what could not be written ends all ranks alike, and what was not done is said.
    ///
    /// # Errors
    /// That something could not be written, or a rank is lost.
    pub(super) fn close(&self, transport: &mut impl Transport, observer: &Observer) -> Result<(), RankError> {
        if self.rank == Rank(0)
            && !self.is_over()
            && let [first, others @ ..] = &self.lines[self.next..]
        {
            note_not_made(&self.source, others.len() + 1, first.step, observer);
        }
        all_well(transport, self.failure.as_ref()).map_err(Into::into)
    }

    /// Once nobody will be heard any more: tells of what was said for steps that were not made, if a refusal was not the end.
    pub(super) fn leave(&self, observer: &Observer) {
        if self.rank == Rank(0)
            && !self.is_over()
            && let Some((lines, first)) = observer.host.as_ref().and_then(|host| host.undone())
        {
            note_not_made(LIVE, lines, first, observer);
        }
    }

    /// Does what is planned for the step that is to be made next, and answers what is asked of the world as it is. Once all steps
    /// are made nothing is done any more, and nothing answered that is asked after something to do.
    ///
    /// # Errors
    /// If a rank is lost.
    pub(super) fn take_turn<T: Transport>(
        &mut self,
        world: &mut World,
        halo: &mut RankHalo<Counting<T>>,
        observer: &Observer,
    ) -> Result<(), RankError> {
        let (step, first) = (world.step_count(), self.next);
        let due = self.lines[first..].iter().take_while(|line| line.step <= step);
        // What is left is told of at the end.
        let is_due = |line: &&Line| step < self.steps || matches!(line.action, Action::Ask(_));
        let lines: Vec<Line> = due.take_while(is_due).cloned().collect();
        if lines.is_empty() {
            return Ok(());
        }
        self.next += lines.len();
        let (begun, sent, source) = (Instant::now(), halo.transport().stats(), self.source.clone());
        let done = self.obey(&lines, &source, world, halo.transport(), observer);
        self.leave_out(first);
        self.time += begun.elapsed();
        self.sent += halo.transport().stats().since(&sent);
        done
    }

    /// Forgets those that were just refused of the lines from the place `first` on.
    fn leave_out(&mut self, first: usize) {
        if self.refused.is_empty() {
            return;
        }
        let places: BTreeSet<usize> = self.refused.iter().map(|place| first + place).collect();
        let stay = self.lines.drain(..).enumerate().filter(|(place, _)| !places.contains(place));
        self.lines = stay.map(|(_, line)| line).collect();
        self.next -= places.len();
        let left_out = self.kept.as_mut().map_or(Ok(()), |kept| kept.leave_out(&places));
        self.failure = self.failure.take().or(left_out.err());
    }

    /// Does what whoever drives the run says, each line of bytes after its number.
    ///
    /// # Errors
    /// As [`take_turn`](Self::take_turn).
    pub(super) fn hear(
        &mut self,
        words: &[u8],
        world: &mut World,
        transport: &mut impl Transport,
        observer: &Observer,
    ) -> Result<(), RankError> {
        let (source, step) = (LIVE, world.step_count());
        let is_past = step >= self.steps;
        for text in String::from_utf8_lossy(words).lines() {
            let (number, text) = text.split_once('\t').unwrap_or(("0", text));
            let number = number.parse().unwrap_or(0);
            let line = word(number, text, step).and_then(|word| match word {
                Word::Line(line, _) if line.step == step => Ok(line),
                Word::Line(line, _) => Err(format!("{step} steps are made, and it is for step {}", line.step)),
                Word::Until(_) => Err(NO_UNTIL.to_owned()),
            });
            match line {
                Ok(line) if is_past && !matches!(line.action, Action::Ask(_)) => {
                    let reason =
                        format!("{}: all steps are made, and nothing can be done any more", place(source, number));
                    self.tell(step, line.name.as_deref(), Answer::Refused { line: number, reason: &reason });
                    if self.is_page && self.rank == Rank(0) {
                        observer.note(&reason);
                    }
                }
                Ok(line) => {
                    self.obey(&[line], source, world, transport, observer)?;
                    if self.refused.is_empty() {
                        let added = self.kept.as_mut().map_or(Ok(()), |kept| kept.add(text));
                        self.failure = self.failure.take().or(added.err());
                    }
                }
                Err(reason) => self.refuse(source, (number, named(text).as_deref()), step, &reason, observer),
            }
            if self.is_over() {
                break;
            }
        }
        Ok(())
    }

    /// Tells whoever drives the run that it is his turn.
    pub(super) fn wait(&mut self, step: u64) {
        let done = std::mem::take(&mut self.done_before);
        self.tell(step, None, Answer::Waits { done });
    }

    fn tell(&mut self, step: u64, name: Option<&str>, answer: Answer<'_>) {
        if let Some(answers) = &mut self.answers
            && let Err(error) = answers.add(&answer.to_line(step, name))
        {
            self.failure.get_or_insert(not_written(answers.path(), &error));
        }
    }

    fn obey(
        &mut self,
        lines: &[Line],
        source: &str,
        world: &mut World,
        transport: &mut impl Transport,
        observer: &Observer,
    ) -> Result<(), RankError> {
        self.refused.clear();
        let done = self.obey_each(lines, source, world, transport, observer);
        world.settle();
        done
    }

    fn obey_each(
        &mut self,
        lines: &[Line],
        source: &str,
        world: &mut World,
        transport: &mut impl Transport,
        observer: &Observer,
    ) -> Result<(), RankError> {
        let step = world.step_count();
        let mut present = find(lines, world, transport)?;
        let mut asked: Vec<(&Line, &Question)> = Vec::new();
        for (place, line) in lines.iter().enumerate() {
            if let Action::Ask(question) = &line.action {
                asked.push((line, question));
                self.state.count_line();
                continue;
            }
            self.answer(&std::mem::take(&mut asked), world, transport)?;
            if let Action::Tell(event, is_told) = line.action {
                // What is gone already ends no contact later: so it is where each line is heard alone.
                world.settle();
                self.state.tell(event, is_told);
                self.followed.set(event, is_told, world, transport)?;
                self.is_used = true;
            }
            let commands = match acts(line, self.state.next, &mut present, &self.crowds, world) {
                Ok(commands) => commands,
                Err(reason) => {
                    self.refused.insert(place);
                    self.refuse(source, (line.number, line.name.as_deref()), step, &reason, observer);
                    if self.is_over() {
                        break;
                    }
                    continue;
                }
            };
            self.state.count_line();
            for command in &commands {
                world.command(command).map_err(RankError::Setup)?;
                self.state.note(command, step);
                self.is_used = true;
            }
            self.crowds.note(&commands);
            if let Action::Add(bodies) = &line.action
                && (line.name.is_some() || bodies.iter().any(|new| !new.is_named))
            {
                let ids: Vec<u64> = commands.iter().filter_map(added).map(|id| id.0).collect();
                self.tell(step, line.name.as_deref(), Answer::Added(&ids));
            }
        }
        self.answer(&asked, world, transport)
    }

    /// Tells why a line, of this number and name, is not done. That ends the run, as long as it is not to be left out.
    fn refuse(
        &mut self,
        source: &str,
        (line, name): (u64, Option<&str>),
        step: u64,
        reason: &str,
        observer: &Observer,
    ) {
        let text = refusal(source, (line, name), step, reason);
        self.tell(step, name, Answer::Refused { line, reason: &text });
        let is_past = source == LIVE && step >= self.steps;
        if self.skips || self.is_page && source == LIVE {
            if self.rank == Rank(0) {
                observer.note(&format!("{text}; left out"));
            }
        } else if !is_past {
            self.refusal = Some(format!("{text}; {MEND}{}", self.remedy));
        }
    }

    fn answer(
        &mut self,
        asked: &[(&Line, &Question)],
        world: &World,
        transport: &mut impl Transport,
    ) -> Result<(), RankError> {
        if asked.is_empty() {
            return Ok(());
        }
        let is_inside = |(_, question): &(&Line, &Question)| matches!(question, Question::Inside(_));
        let sensors = if asked.iter().any(is_inside) { events::sensors(world, transport)? } else { Vec::new() };
        let own: Vec<Part> = asked.iter().map(|(_, question)| Part::of(question, world, &sensors)).collect();
        let own = serde_json::to_vec(&own).expect("numbers, under names");
        let Some(parts) = transport.gather(Rank(0), &own).map_err(RankError::Transport)? else { return Ok(()) };
        let mut joined: Option<Vec<Part>> = None;
        for (rank, bytes) in parts.iter().enumerate() {
            let lost = || RankError::Transport(unreadable(Rank::from_index(rank)));
            let parts: Vec<Part> = serde_json::from_slice(bytes).map_err(|_| lost())?;
            joined = Some(match joined {
                Some(joined) => joined.into_iter().zip(parts).map(|(a, b)| a.join(b)).collect(),
                None => parts,
            });
        }
        let names = std::mem::take(&mut self.names);
        for ((line, question), part) in asked.iter().zip(joined.unwrap_or_default()) {
            self.tell(world.step_count(), line.name.as_deref(), Answer::To(question, &part, &names));
        }
        self.names = names;
        Ok(())
    }

    /// Tells which contacts began and ended in the last step, and who entered and left sensors, where somebody wants to know.
    ///
    /// # Errors
    /// If a rank is lost.
    pub(super) fn after_step<T: Transport>(
        &mut self,
        world: &World,
        halo: &mut RankHalo<Counting<T>>,
    ) -> Result<(), RankError> {
        self.crowds = Crowds::default();
        self.state.pass(world.step_count());
        if !Event::ALL.iter().any(|&event| self.state.tells(event)) {
            return Ok(());
        }
        let (begun, sent) = (Instant::now(), halo.transport().stats());
        for event in Event::ALL {
            if let Some([began, ended]) = self.followed.follow(event, world, halo.transport())?
                && !(began.is_empty() && ended.is_empty())
            {
                self.tell(world.step_count(), None, Answer::Events { event, began: &began, ended: &ended });
            }
        }
        self.time += begun.elapsed();
        self.sent += halo.transport().stats().since(&sent);
        Ok(())
    }
}

fn not_written(path: &std::path::Path, error: &io::Error) -> RunError {
    RunError::Output { path: path.to_owned(), reason: error.to_string() }
}

fn not_opened(path: &std::path::Path, error: &io::Error) -> RunError {
    if error.kind() != io::ErrorKind::InvalidData {
        return not_written(path, error);
    }
    let what = format!("not what a run answered ({error})");
    RunError::TakenOutput { option: "--answers", path: path.to_owned(), what }
}

fn added(command: &Command) -> Option<GlobalId> {
    if let Command::Add(body) = command { Some(body.id) } else { None }
}
