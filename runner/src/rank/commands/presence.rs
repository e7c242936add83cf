//! Whether commands can be done: which of the bodies that they speak of there are, whoever holds them; and which names are free.

use super::super::{RankError, records};
use crate::command::{Action, Line, NewBody};
use crate::plan::Plan;
use crate::scene::{MOST_AT_A_PLACE, place_of};
use atoll_core::{Body, Command, GlobalId, SetupError, World};
use atoll_transport::{Collective, Transport};
use std::collections::{BTreeMap, BTreeSet};

/// For each body that is spoken of how it is, if there is one.
pub(super) type Present = BTreeMap<GlobalId, Option<Body>>;

/// The body that a command is about, if there is one that must be there.
fn subject(command: &Command) -> Option<GlobalId> {
    match *command {
        Command::Remove(id)
        | Command::SetVelocity { id, .. }
        | Command::Impulse { id, .. }
        | Command::Force { id, .. }
        | Command::SetKind { id, .. }
        | Command::Wake(id) => Some(id),
        Command::Add(_) | Command::AddKind(_) | Command::SetGravity(_) => None,
    }
}

/// All bodies that lines speak of.
pub(super) fn spoken_of(lines: &[Line]) -> BTreeSet<GlobalId> {
    let mut ids = BTreeSet::new();
    for line in lines {
        match &line.action {
            Action::Add(bodies) => ids.extend(bodies.iter().filter(|new| new.is_named).map(|new| new.body.id)),
            Action::Do(commands) => ids.extend(commands.iter().filter_map(subject)),
            Action::Ask(_) | Action::Tell(..) => {}
        }
    }
    ids
}

/// Which of all bodies that lines speak of there are.
pub(super) fn find(lines: &[Line], world: &World, transport: &mut impl Transport) -> Result<Present, RankError> {
    let ids = spoken_of(lines);
    if ids.is_empty() {
        return Ok(Present::new());
    }
    let own: Vec<Body> = ids.iter().filter_map(|&id| world.get(id)).collect();
    let told = if transport.size() == 1 {
        own
    } else {
        let told = transport.all_gather(bytemuck::cast_slice(&own)).map_err(RankError::Transport)?;
        records(&told).map_err(RankError::Transport)?
    };
    let mut present: Present = ids.into_iter().map(|id| (id, None)).collect();
    present.extend(told.into_iter().map(|body| (body.id, Some(body))));
    Ok(present)
}

/// What a line does, if all of it can be done: bodies that have no name get the next ones from `next` on. `present` goes on with
/// what is there afterwards. The error is why not.
pub(super) fn acts(
    line: &Line,
    next: u64,
    present: &mut Present,
    crowds: &Crowds,
    world: &World,
) -> Result<Vec<Command>, String> {
    let commands = match &line.action {
        Action::Add(bodies) => crowds.check(bodies).and_then(|()| named(bodies, next, world))?,
        Action::Do(commands) => commands.clone(),
        Action::Ask(_) | Action::Tell(..) => Vec::new(),
    };
    check(&commands, present, world).map(|()| commands)
}

/// Bodies that have no name of their own get the next ones, as long as there are some. What is wrong with one of these is said of where
/// it is, as nobody has said that name.
fn named(bodies: &[NewBody], mut next: u64, world: &World) -> Result<Vec<Command>, String> {
    let named = |new: &NewBody| {
        let mut body = new.body;
        if !new.is_named {
            if next == u64::MAX {
                return Err("no name is left above those of all bodies; give it one of its own".to_owned());
            }
            body.id = GlobalId(next);
            if let Err(SetupError::BadBody { fault, .. }) = world.check(&Command::Add(body)) {
                return Err(format!("the body at {:?}, {:?}: {fault}", body.position.x, body.position.y));
            }
        }
        next = next.max(body.id.0.saturating_add(1));
        Ok(Command::Add(body))
    };
    bodies.iter().map(named).collect()
}

/// Whether all of these can be done, one after the other; `present` goes on with what is there afterwards. The error is why not.
fn check(commands: &[Command], present: &mut Present, world: &World) -> Result<(), String> {
    let mut before: Vec<(GlobalId, Option<Option<Body>>)> = Vec::new();
    for command in commands {
        match outcome(command, present, world) {
            Ok(Some((id, after))) => before.push((id, present.insert(id, after))),
            Ok(None) => {}
            Err(reason) => {
                let is_gone = |id: &GlobalId| matches!(present.get(id), Some(None));
                let removed = subject(command).filter(|id| is_gone(id) && before.iter().any(|(of, _)| of == id));
                for (id, was) in before.into_iter().rev() {
                    match was {
                        Some(was) => present.insert(id, was),
                        None => present.remove(&id),
                    };
                }
                return Err(removed.map_or(reason, |id| format!("{id} is removed already, by the same line")));
            }
        }
    }
    Ok(())
}

/// The body that a command is about, if it is about one, and how that is afterwards, if it is still there.
fn outcome(command: &Command, present: &Present, world: &World) -> Result<Option<(GlobalId, Option<Body>)>, String> {
    world.check(command).map_err(|error| error.to_string())?;
    let of = |id: GlobalId| present.get(&id).copied().flatten();
    let body = match command {
        Command::Add(body) if of(body.id).is_some() => {
            return Err(format!("there is a body {} already; give each a name of its own, or none", body.id));
        }
        Command::Add(body) => *body,
        command => match subject(command) {
            Some(id) if world.is_static(id) => {
                return Err(format!("{id} is a static, and stays as it is; name a body"));
            }
            Some(id) => of(id).ok_or_else(|| format!("there is no body {id}"))?,
            None => return Ok(None),
        },
    };
    let after = world.outcome(command, body).map_err(|error| error.to_string())?;
    Ok(Some((body.id, Some(after).filter(|_| !matches!(command, Command::Remove(_))))))
}

/// Which bodies came before the next step and are still there, by lines that were done.
#[derive(Default)]
pub(super) struct Crowds {
    /// Where each is.
    places: BTreeMap<GlobalId, [u64; 2]>,
    /// How many there are at each place.
    counts: BTreeMap<[u64; 2], usize>,
}

impl Crowds {
    /// Whether so many may come beside those that came: no more to one place than the file of a scene may have there. The error is
    /// why not.
    pub(super) fn check(&self, bodies: &[NewBody]) -> Result<(), String> {
        let mut more: BTreeMap<[u64; 2], usize> = BTreeMap::new();
        for place in bodies.iter().map(|new| place_of(&new.body)) {
            let count = more.entry(place).or_default();
            *count += 1;
            if *count + self.counts.get(&place).copied().unwrap_or_default() > MOST_AT_A_PLACE {
                let [x, y] = place.map(f64::from_bits);
                return Err(format!(
                    "more than {MOST_AT_A_PLACE} bodies would come to {x:?}, {y:?} at once, where every two of them would be a \
                     contact; give each a place of its own"
                ));
            }
        }
        Ok(())
    }

    /// That these were done.
    pub(super) fn note(&mut self, commands: &[Command]) {
        for command in commands {
            match command {
                Command::Add(body) => {
                    let place = place_of(body);
                    self.places.insert(body.id, place);
                    *self.counts.entry(place).or_default() += 1;
                }
                Command::Remove(id) => {
                    let count = self.places.remove(id).and_then(|place| self.counts.get_mut(&place));
                    count.into_iter().for_each(|count| *count -= 1);
                }
                _ => {}
            }
        }
    }
}

/// A name above all that there are.
pub(super) fn next_name(plan: &Plan, world: &World, transport: &mut impl Transport) -> Result<u64, RankError> {
    let own = world.bodies().map(|body| body.id).chain(plan.blueprint.statics.iter().map(|fixed| fixed.id)).max();
    let own = own.map_or(0, |id| id.0.saturating_add(1));
    let told = transport.all_gather(&own.to_le_bytes()).map_err(RankError::Transport)?;
    Ok(records::<u64>(&told).map_err(RankError::Transport)?.into_iter().max().unwrap_or_default())
}

#[cfg(test)]
mod tests {
    use super::*;
    use atoll_core::KindId;
    use glam::DVec2;

    #[test]
    fn lines_of_one_step_crowd_a_place_together() {
        let at = |x: f64, count: u64| -> Vec<NewBody> {
            let body = |id| Body::at_rest(GlobalId(id), KindId(0), DVec2::new(x, 1e-300));
            (0..count).map(|id| NewBody { is_named: true, body: body(id) }).collect()
        };
        let mut crowds = Crowds::default();
        assert_eq!(crowds.check(&at(0.0, 1000)), Ok(()));
        crowds.note(&at(0.0, 1000).iter().map(|new| Command::Add(new.body)).collect::<Vec<_>>());
        assert_eq!(crowds.check(&at(2.0, 1000)), Ok(()));
        for x in [0.0, -0.0] {
            let told = crowds.check(&at(x, 1)).unwrap_err();
            assert!(told.starts_with("more than 1000 bodies would come to 0.0, 1e-300 at once"), "{told}");
        }
        // Who is gone again makes room, once.
        crowds.note(&[Command::Remove(GlobalId(7)), Command::Remove(GlobalId(7)), Command::Remove(GlobalId(5000))]);
        assert_eq!(crowds.check(&at(0.0, 1)), Ok(()));
        assert!(crowds.check(&at(0.0, 2)).is_err());
    }
}
