//! Frames of another rank, as `Inbox::decode` reads them.

use super::Outcome;
use atoll_core::{
    Blueprint, BorderImpulse, CodecError, ContactRecord, Exchange, FORMAT, GhostRecord, GhostRefresh, Halo, Inbox,
    Kind, Material, Message, MigrantRecord, Outbox, Params, Partition, Shape, StepError, TileId, World, step,
};
use bytemuck::cast_slice;
use glam::DVec2;

/// Tiles of the world whose inbox reads frames; it holds tile 0 alone.
pub const TILES: u32 = 4;

/// Where things stand in a frame, in bytes.
#[derive(Debug)]
pub struct FrameLayout {
    /// Where the header has the version of the format.
    pub format: usize,
    /// Where it has the step.
    pub step: usize,
    /// Where it has the sync point.
    pub sync: usize,
    /// Where it has the number of messages.
    pub messages: usize,
    /// Its length: where what is said of the first message begins.
    pub header: usize,
    /// How much is said of a message before all records: from where, to where, and five counts.
    pub counts: usize,
}

/// After the description of the format alone, as [`frame`] is.
pub const FRAME: FrameLayout = FrameLayout { format: 0, step: 4, sync: 12, messages: 16, header: 20, counts: 7 * 4 };

/// A halo that lets somebody else read the first frames, and then ends the step.
struct Ear<F, R> {
    listen: Option<F>,
    heard: Option<R>,
}

impl<F: FnOnce(&mut Inbox) -> R, R> Halo for Ear<F, R> {
    type Error = ();

    fn exchange(&mut self, _: &mut Outbox, inbox: &mut Inbox) -> Result<(), ()> {
        self.heard = self.listen.take().map(|listen| listen(inbox));
        Err(())
    }
}

/// Gives a new, empty inbox to `listen`: that of a rank which holds the first of [`TILES`] tiles, knows one kind of
/// body, and waits for the frames of step 0, sync point 0.
fn receive<R>(listen: impl FnOnce(&mut Inbox) -> R) -> R {
    let blueprint = Blueprint {
        params: Params { exchange: Exchange::Substep, ..Params::default() },
        partition: Partition::uniform(DVec2::ZERO, DVec2::splat(20.0), 2, TILES / 2).expect("a domain with a size"),
        kinds: vec![Kind::new(Shape::circle(0.2), Material::default())],
        statics: Vec::new(),
    };
    let mut world = World::new(&blueprint, &[TileId(0)]).expect("a world that can be built");
    let mut ear = Ear { listen: Some(listen), heard: None };
    let end = step(&mut world, &mut ear);
    assert!(matches!(end, Err(StepError::Halo(()))), "the halo ends the step");
    ear.heard.expect("a step begins with an exchange")
}

/// A message that owns its records.
#[derive(Clone, Default, Debug)]
pub struct Letter {
    /// Source.
    pub from: TileId,
    /// Destination.
    pub to: TileId,
    /// As in [`Message`], here and below.
    pub migrants: Vec<MigrantRecord>,
    /// Contacts of those bodies.
    pub contacts: Vec<ContactRecord>,
    /// Ghosts.
    pub ghosts: Vec<GhostRecord>,
    /// The ghosts' state after a substep.
    pub refreshes: Vec<GhostRefresh>,
    /// What border contacts did.
    pub impulses: Vec<BorderImpulse>,
}

impl Letter {
    /// The message itself.
    pub fn message(&self) -> Message<'_> {
        let Self { from, to, migrants, contacts, ghosts, refreshes, impulses } = self;
        Message { from: *from, to: *to, migrants, contacts, ghosts, refreshes, impulses }
    }
}

/// A frame of some step and sync point, written after the description of the format alone: what `Frames::encode` would
/// write.
pub fn frame<'a>((step, sync): (u64, u32), messages: impl Iterator<Item = Message<'a>> + Clone) -> Vec<u8> {
    let mut bytes = Vec::new();
    let count = |length: usize| (length as u32).to_le_bytes();
    bytes.extend(FORMAT.to_le_bytes());
    bytes.extend(step.to_le_bytes());
    bytes.extend(sync.to_le_bytes());
    bytes.extend(count(messages.clone().count()));
    for Message { from, to, migrants, contacts, ghosts, refreshes, impulses } in messages.clone() {
        let records = [migrants.len(), contacts.len(), ghosts.len(), refreshes.len(), impulses.len()];
        bytes.extend([from.0.to_le_bytes(), to.0.to_le_bytes()].concat());
        bytes.extend(records.map(count).concat());
    }
    for Message { migrants, contacts, ghosts, refreshes, impulses, .. } in messages {
        let records: [&[u8]; 5] = [
            cast_slice(migrants),
            cast_slice(contacts),
            cast_slice(ghosts),
            cast_slice(refreshes),
            cast_slice(impulses),
        ];
        bytes.extend(records.concat());
    }
    bytes
}

/// A frame is refused in one line, or it means what it says: written again, it is the same bytes.
pub fn codec(bytes: &[u8]) -> Outcome<CodecError> {
    codec_by(bytes, |inbox| inbox.decode(bytes))
}

/// As [`codec`], for whoever does something around the decoding.
pub fn codec_by(bytes: &[u8], decode: impl FnOnce(&mut Inbox) -> Result<(), CodecError>) -> Outcome<CodecError> {
    let decoded = receive(|inbox| {
        let result = decode(inbox);
        result.map(|()| frame((0, 0), inbox.messages()))
    });
    if let Ok(again) = &decoded {
        assert!(again == bytes, "{bytes:02x?} were taken for {again:02x?}");
    }
    Outcome::of(decoded)
}
