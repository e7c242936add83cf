//! What is done to a world between two steps, and asked of it: all ranks take the same lines in the same order, and whether one can
//! be done depends on the whole world, of which they tell each other beforehand.

mod events;
mod presence;

use super::halo::RankHalo;
use super::trouble::all_well;
use super::{Observer, RankError, unreadable};
use crate::command::{Action, Answer, Event, Line, NO_UNTIL, NewBody, Part, Question, State, Word, word};
use crate::error::{Exit, RunError};
use crate::folder::AnswersFile;
use crate::plan::Plan;
use crate::wording::OneLine;
use atoll_core::{Command, GlobalId, World};
use atoll_transport::{Collective, Counting, Rank, Stats, Transport};
use events::Followed;
use presence::{Crowds, check, find, next_name};
use std::fs::{File, OpenOptions};
use std::io::{self, Write};
use std::path::PathBuf;
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
    /// Where what is done is kept, by one rank of a run that has a folder; opened when there is something.
    kept_in: Option<PathBuf>,
    record: Option<File>,
    /// What there was after the last step of what is told.
    followed: Followed,
    /// What the scene calls its kinds.
    names: Vec<Option<String>>,
    crowds: Crowds,
    failure: Option<RunError>,
    /// After how many steps it was last said that the run waits.
    waits_after: Option<u64>,
    /// How long all of this took this rank, and what ranks sent each other for it.
    pub(super) time: Duration,
    pub(super) sent: Stats,
}

/// What the words of whoever drives a run are called in errors.
const LIVE: &str = "what was said";

/// Where a line stands. What pages say has no numbers.
fn place(source: &str, number: u64) -> String {
    if number == 0 { "a hand on the page".to_owned() } else { format!("{source}: line {number}") }
}

impl Commander {
    /// For a rank that begins, or goes on from the snapshot of the step `resumed`, which had this `state`.
    ///
    /// # Errors
    /// If what is done or answered cannot be written down.
    pub(super) fn start(
        plan: &Plan,
        rank: Rank,
        (resumed, state): (Option<u64>, Option<State>),
        world: &World,
        transport: &mut impl Transport,
    ) -> Result<Self, RankError> {
        let commands = &plan.commands;
        let from = resumed.unwrap_or(0);
        let script = commands.to_come();
        let lines: Vec<Line> =
            script.map_or(&[][..], |script| &script.lines).iter().filter(|line| line.step >= from).cloned().collect();
        let is_used = state.is_some();
        let mut commander = Self {
            rank,
            next: 0,
            lines,
            source: script.map_or(String::new(), |script| script.path.display().to_string()),
            skips: commands.skips,
            is_page: !commands.drives,
            steps: plan.config.run.steps,
            state: match state {
                Some(state) => state,
                None => State::new(next_name(plan, world, transport)?),
            },
            is_used,
            answers: None,
            kept_in: plan.output.as_ref().map(|output| output.folder.commands()).filter(|_| rank == Rank(0)),
            record: None,
            followed: Followed::default(),
            names: plan.kind_names().to_vec(),
            crowds: Crowds::default(),
            failure: None,
            waits_after: None,
            time: Duration::ZERO,
            sent: Stats::default(),
        };
        for event in Event::ALL {
            commander.followed.set(event, commander.state.tells(event), world, transport)?;
        }
        let opened = if rank == Rank(0) { commander.open(plan, from) } else { Ok(()) };
        all_well(transport, opened.as_ref().err())?;
        Ok(commander)
    }

    /// Opens what one rank writes.
    fn open(&mut self, plan: &Plan, from: u64) -> Result<(), RunError> {
        if let Some(path) = &plan.commands.answers {
            let opened = AnswersFile::open(path, from);
            self.answers = Some(opened.map_err(|error| not_written(path, &error))?);
        }
        let Some(output) = &plan.output else { return Ok(()) };
        let written = output.folder.write_commands(&plan.commands.record(from));
        written.map_err(|error| not_written(&output.folder.commands(), &error))
    }

    /// What a snapshot is to tell of it, if there is anything.
    pub(super) fn state(&self) -> Option<&State> {
        self.is_used.then_some(&self.state)
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
            && let [first, others @ ..] = &self.lines[self.next..]
        {
            let (rest, step) = (others.len() + 1, first.step);
            let rest = if rest == 1 { "1 line is".to_owned() } else { format!("{rest} lines are") };
            observer.note(&format!("{}: {rest} for steps from {step} on, which were not made", self.source));
        }
        all_well(transport, self.failure.as_ref()).map_err(Into::into)
    }

    /// Does what is planned for the step that is to be made next, and answers what is asked of the world as it is. Once all steps
    /// are made nothing is done any more.
    ///
    /// # Errors
    /// If a rank is lost, or something cannot be done and is not to be left out.
    pub(super) fn take_turn<T: Transport>(
        &mut self,
        world: &mut World,
        halo: &mut RankHalo<Counting<T>>,
        observer: &Observer,
    ) -> Result<(), RankError> {
        let step = world.step_count();
        let end = self.next + self.lines[self.next..].partition_point(|line| line.step <= step);
        if self.next == end {
            return Ok(());
        }
        let mut lines: Vec<Line> = self.lines[self.next..end].to_vec();
        if step == self.steps {
            // What is left is told of at the end.
            self.lines.splice(self.next..end, lines.extract_if(.., |line| !matches!(line.action, Action::Ask(_))));
        } else {
            self.next = end;
        }
        let (begun, sent, source) = (Instant::now(), halo.transport().stats(), self.source.clone());
        let done = self.obey(&lines, &source, world, halo.transport(), observer);
        self.time += begun.elapsed();
        self.sent += halo.transport().stats().since(&sent);
        done
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
        for text in String::from_utf8_lossy(words).lines() {
            let (number, text) = text.split_once('\t').unwrap_or(("0", text));
            let number = number.parse().unwrap_or(0);
            let line = word(number, text, step).and_then(|word| match word {
                Word::Line(line, _) if line.step == step => Ok(line),
                Word::Line(line, _) => Err(format!("{step} steps are made, and it is for step {}", line.step)),
                Word::Until(_) => Err(NO_UNTIL.to_owned()),
            });
            match line {
                Ok(line) if step >= self.steps && !matches!(line.action, Action::Ask(_)) => {
                    let text =
                        format!("{}: all steps are made, and nothing can be done any more", place(source, number));
                    self.tell(step, None, Answer::Refused(&text));
                    if self.is_page && self.rank == Rank(0) {
                        observer.note(&text);
                    }
                }
                Ok(line) => {
                    self.write_down(text);
                    self.obey(&[line], source, world, transport, observer)?;
                }
                Err(reason) => self.refuse(source, number, step, &reason, observer)?,
            }
        }
        Ok(())
    }

    /// Tells whoever drives the run that it is his turn.
    pub(super) fn wait(&mut self, step: u64) {
        if self.waits_after.replace(step) != Some(step) {
            self.tell(step, None, Answer::Waits);
        }
    }

    /// Keeps what was said, before it is done.
    fn write_down(&mut self, text: &str) {
        let Some(path) = &self.kept_in else { return };
        let open = || OpenOptions::new().create(true).append(true).open(path);
        let file = match &mut self.record {
            Some(file) => Ok(file),
            record => open().map(|file| record.insert(file)),
        };
        let written = file.and_then(|file| file.write_all(format!("{text}\n").as_bytes()));
        if let Err(error) = written {
            self.failure = Some(not_written(path, &error));
        }
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
        for line in lines {
            if let Action::Ask(question) = &line.action {
                asked.push((line, question));
                continue;
            }
            self.answer(&std::mem::take(&mut asked), world, transport)?;
            let commands = match &line.action {
                Action::Add(bodies) => self.crowds.check(bodies).and_then(|()| self.name(bodies)),
                Action::Do(commands) => Ok(commands.clone()),
                Action::Tell(event, is_told) => {
                    // What is gone already ends no contact later: so it is where each line is heard alone.
                    world.settle();
                    self.state.tell(*event, *is_told);
                    self.followed.set(*event, *is_told, world, transport)?;
                    self.is_used = true;
                    continue;
                }
                Action::Ask(_) => continue,
            };
            let commands = match commands.and_then(|all| check(&all, &mut present, world).map(|()| all)) {
                Ok(commands) => commands,
                Err(reason) => {
                    self.refuse(source, line.number, step, &reason, observer)?;
                    continue;
                }
            };
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

    /// Bodies that have no name of their own get the next ones, as long as there are some.
    fn name(&self, bodies: &[NewBody]) -> Result<Vec<Command>, String> {
        let mut next = self.state.next;
        let named = |new: &NewBody| {
            let mut body = new.body;
            if !new.is_named {
                if next == u64::MAX {
                    return Err("no name is left above those of all bodies; give it one of its own".to_owned());
                }
                body.id = GlobalId(next);
            }
            next = next.max(body.id.0.saturating_add(1));
            Ok(Command::Add(body))
        };
        bodies.iter().map(named).collect()
    }

    fn refuse(
        &mut self,
        source: &str,
        number: u64,
        step: u64,
        reason: &str,
        observer: &Observer,
    ) -> Result<(), RankError> {
        let text = format!("{}: step {step}: {}", place(source, number), OneLine(reason));
        self.tell(step, None, Answer::Refused(&text));
        if self.skips || self.is_page && source == LIVE {
            if self.rank == Rank(0) {
                observer.note(&format!("{text}; left out"));
            }
            return Ok(());
        }
        let text = format!("{text}; mend it, or leave out what cannot be done by --skip-refused");
        Err(RankError::Agreed { text, exit: Exit::Usage })
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

fn added(command: &Command) -> Option<GlobalId> {
    if let Command::Add(body) = command { Some(body.id) } else { None }
}
