//! What the commands of a run add up to beside its tiles: part of a snapshot, so that a run goes on without the commands that were.

use super::text::Event;
use crate::scene::record::KindText;
use atoll_core::{Command, GlobalId, SetupError, World};
use glam::Vec2;
use serde::{Deserialize, Serialize};

/// What a world is told when it goes on.
#[derive(Clone, PartialEq, Default, Debug, Serialize, Deserialize)]
pub(crate) struct State {
    /// How many more bodies there are than at the start.
    pub(crate) added: i64,
    /// The name of the next body that is given none.
    pub(crate) next: u64,
    /// If it is another than at the start, in m/s^2.
    #[serde(skip_serializing_if = "Option::is_none")]
    gravity: Option<[f32; 2]>,
    /// Rows that were added to the table of kinds.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    kinds: Vec<KindText>,
    /// How many lines of the step that is made next are done: more than none where a line after them was refused.
    #[serde(default, skip_serializing_if = "is_none")]
    pub(crate) done: u64,
    /// How many lines are done in all.
    #[serde(default)]
    pub(crate) lines: u64,
    /// Forces that push still.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    forces: Vec<Push>,
    /// Whether contacts that begin and end are told.
    #[serde(default)]
    tells_contacts: bool,
    /// Whether bodies that enter and leave sensors are told.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    tells_sensors: bool,
    /// What commands have done to contacts since the last step, as far as it is to be told after the next.
    #[serde(default, skip_serializing_if = "Since::is_nothing")]
    contacts_since: Since,
    /// The same of who is inside sensors.
    #[serde(default, skip_serializing_if = "Since::is_nothing")]
    insides_since: Since,
}

/// Pairs that came and went since the last step, ascending.
#[derive(Clone, PartialEq, Default, Debug, Serialize, Deserialize)]
pub(crate) struct Since {
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub(crate) came: Vec<[u64; 2]>,
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub(crate) went: Vec<[u64; 2]>,
}

impl Since {
    fn is_nothing(&self) -> bool {
        self.came.is_empty() && self.went.is_empty()
    }
}

fn is_none(count: &u64) -> bool {
    *count == 0
}

#[derive(Clone, Copy, PartialEq, Debug, Serialize, Deserialize)]
struct Push {
    id: u64,
    force: [f32; 2],
    torque: f32,
    /// It pushes in the steps before this one is made.
    until: u64,
}

impl State {
    /// Before any command, where bodies have names below this one.
    pub(crate) fn new(next: u64) -> Self {
        Self { next, ..Self::default() }
    }

    /// Whether some events are told.
    pub(crate) fn tells(&self, event: Event) -> bool {
        match event {
            Event::Contacts => self.tells_contacts,
            Event::Sensors => self.tells_sensors,
        }
    }

    /// Has some events told from now on, or no more.
    pub(crate) fn tell(&mut self, event: Event, is_told: bool) {
        match event {
            Event::Contacts => self.tells_contacts = is_told,
            Event::Sensors => self.tells_sensors = is_told,
        }
    }

    /// What came and went of the pairs that some events are about.
    pub(crate) fn since(&mut self, event: Event) -> &mut Since {
        match event {
            Event::Contacts => &mut self.contacts_since,
            Event::Sensors => &mut self.insides_since,
        }
    }

    /// Counts a line that is done.
    pub(crate) fn count_line(&mut self) {
        self.done += 1;
        self.lines += 1;
    }

    /// Notes a command that was done after `step` steps.
    pub(crate) fn note(&mut self, command: &Command, step: u64) {
        match *command {
            Command::Add(ref body) => {
                self.added += 1;
                self.next = self.next.max(body.id.0.saturating_add(1));
            }
            Command::Remove(id) => {
                self.added -= 1;
                self.forces.retain(|push| push.id != id.0);
            }
            Command::SetGravity(gravity) => self.gravity = Some(gravity.to_array()),
            Command::AddKind(ref kind) => self.kinds.push(KindText::new(kind)),
            Command::Force { id, force, torque, steps } => {
                let until = step.saturating_add(steps);
                self.forces.push(Push { id: id.0, force: force.to_array(), torque, until });
            }
            Command::SetVelocity { .. } | Command::Impulse { .. } | Command::SetKind { .. } | Command::Wake(_) => {}
        }
    }

    /// Forgets what was of the steps before `step` alone, which are made.
    pub(crate) fn pass(&mut self, step: u64) {
        self.done = 0;
        (self.contacts_since, self.insides_since) = Default::default();
        self.forces.retain(|push| push.until > step);
    }

    /// Makes the table of kinds and gravity what they were; before a world gets its tiles back.
    ///
    /// # Errors
    /// If they cannot be.
    pub(crate) fn prepare(&self, world: &mut World) -> Result<(), SetupError> {
        for kind in &self.kinds {
            world.add_kind(&kind.read().ok_or(SetupError::BadKind { kind: atoll_core::KindId(u32::MAX) })?)?;
        }
        if let Some(gravity) = self.gravity {
            world.command(&Command::SetGravity(Vec2::from(gravity)))?;
        }
        Ok(())
    }

    /// Lets forces push on that have not done so for long enough; once a world has its tiles back.
    ///
    /// # Errors
    /// If they cannot be.
    pub(crate) fn resume(&self, world: &mut World) -> Result<(), SetupError> {
        let step = world.step_count();
        for &Push { id, force, torque, until } in self.forces.iter().filter(|push| push.until > step) {
            let steps = until - step;
            world.command(&Command::Force { id: GlobalId(id), force: force.into(), torque, steps })?;
        }
        Ok(())
    }
}
