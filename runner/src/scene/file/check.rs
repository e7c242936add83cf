//! Everything that is wrong with the rows of a scene, and what there is in it.

use super::super::SceneError;
use super::{SceneFile, place_of};
use atoll_core::GlobalId;
use glam::DVec2;
use std::path::Path;

/// What was found in a scene.
#[derive(Debug)]
pub(crate) struct Found {
    /// Bodies of each kind.
    pub(crate) by_kind: Vec<u64>,
    /// Low and high corner of where their centers are, in meters, if there are any.
    pub(crate) extent: Option<(DVec2, DVec2)>,
    /// The least and the greatest id.
    pub(crate) ids: Option<[GlobalId; 2]>,
    /// Bodies that are outside of the domain.
    pub(crate) outside: u64,
    /// How much was wrong with it.
    pub(crate) faults: u64,
}

impl SceneFile {
    /// Looks at all of a scene. Tells of a fault in each of its tables and rows; of ids that are there twice and of crowds at one place once all are
    /// known, and of those one, and how many more there are. Takes 24 bytes for each body.
    ///
    /// # Errors
    /// If there is something wrong that keeps the rows from being read.
    pub(crate) fn check(path: &Path, mut tell: impl FnMut(SceneError)) -> Result<(Self, Found), SceneError> {
        let mut of_text = Vec::new();
        let begun = Self::begin(path, &mut of_text);
        let faults = of_text.len() as u64;
        of_text.into_iter().for_each(&mut tell);
        let (mut scene, told) = begun?;
        let mut found = Found { by_kind: vec![0; scene.kinds().len()], extent: None, ids: None, outside: 0, faults };
        let (low, high) = scene.domain();
        let (mut ids, mut places) = (Vec::new(), Vec::new());
        let mut rows = 0;
        for body in scene.iter() {
            rows += 1;
            match body {
                Ok(body) => {
                    let place = body.position;
                    let (least, most) = found.extent.unwrap_or((place, place));
                    found.extent = Some((least.min(place), most.max(place)));
                    found.by_kind[body.kind.0 as usize] += 1;
                    found.outside += u64::from(!(place.cmpge(low).all() && place.cmple(high).all()));
                    ids.push(body.id);
                    places.push(place_of(&body));
                }
                Err(error) => {
                    found.faults += 1;
                    tell(error);
                }
            }
        }
        scene.count = rows;
        for error in scene.of_all(&mut ids, &mut places).into_iter().flatten() {
            found.faults += 1;
            tell(error);
        }
        found.ids = ids.first().copied().zip(ids.last().copied()).map(|(least, most)| [least, most]);
        let last = ids.last().map(|id| id.0);
        for wrong in [scene.check_count(told), scene.name_statics(last)] {
            if let Err(error) = wrong {
                found.faults += 1;
                tell(error);
            }
        }
        Ok((scene, found))
    }

    /// Refuses bodies that a world is not made of, which shows once all are known. Takes 24 bytes for each.
    ///
    /// # Errors
    /// If an id is there twice, there is a crowd at one place, or they cannot be read.
    pub(crate) fn check_bodies(&self) -> Result<(), SceneError> {
        let (mut ids, mut places) = (Vec::new(), Vec::new());
        for body in self.iter() {
            let body = body?;
            ids.push(body.id);
            places.push(place_of(&body));
        }
        self.of_all(&mut ids, &mut places).into_iter().flatten().next().map_or(Ok(()), Err)
    }

    /// What is wrong with all bodies together: an id that is there twice, a crowd at one place. Sorts both.
    fn of_all(&self, ids: &mut [GlobalId], places: &mut [[u64; 2]]) -> [Option<SceneError>; 2] {
        ids.sort_unstable();
        let mut doubled = ids.chunk_by(|a, b| a == b).filter(|alike| alike.len() > 1);
        let twice = doubled.next().map(|alike| self.doubled(alike[0]).and_more(doubled.count()));
        [twice, self.crowd(places)]
    }
}
