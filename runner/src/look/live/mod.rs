//! See it live: a page in the browser that shows a run while it goes on, or what runs have recorded.
//!
//! The page says what it looks at; each rank draws its part of that, and rank 0 puts the parts together and hands them to the
//! server. A page has one frame at a time, and who looks at nothing costs nothing.

mod desk;
mod figures;
mod host;
mod player;
mod protocol;
mod question;
mod scenery;
mod server;
mod sketch;

use crate::folder::recording::Row;
use crate::look::frame::{Frame, Setting};
use atoll_core::{Kind, Material, Partition, Shape};
use glam::{DVec2, Vec2};

pub(crate) use desk::Desk;
pub(crate) use host::Viewer;
pub(crate) use player::Player;
pub(crate) use server::Server;

/// Hears bytes as if a page had sent them, and draws what they say that it looks at, if that is small. Says whether they are a
/// request, and whether they are a look. For the tests and fuzz targets of this workspace.
pub fn overhear(bytes: &[u8]) -> [bool; 2] {
    let (is_request, gaze) = server::overhear(bytes);
    if let Some(gaze) = gaze.filter(|gaze| gaze.size[0] * gaze.size[1] <= 1 << 12) {
        let shapes = [Shape::Circle { radius: 0.5 }, Shape::Box { half: Vec2::new(0.01, 3.0) }];
        let kinds = shapes.map(|shape| Kind::new(shape, Material::default())).to_vec();
        let partition = Partition::uniform(DVec2::ZERO, DVec2::splat(10.0), 2, 2).expect("it is one");
        let setting = Setting { partition, kinds, names: Vec::new(), statics: Vec::new(), hertz: 60.0 };
        let row =
            |i: u32| Row { id: i.into(), x: f64::from(i), y: 5.0, kind: i % 3, angle: i as f32, ..Row::default() };
        let frame = Frame { bodies: (0..10).map(row).collect(), ranks: vec![(0, 4), (1, 10)], ..Frame::default() };
        player::draw_once(&setting, &frame, gaze);
    }
    [is_request, gaze.is_some()]
}
