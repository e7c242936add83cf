//! Ranks as threads that hand each other frames through channels: the smallest halo there can be for more than one.

use crate::world::Scene;
use atoll_core::{Exchange, Frames, Halo, Inbox, Outbox, TileId, Verdict, World};
use std::sync::mpsc::{Receiver, Sender, channel};
use std::thread;

/// Which rank holds a tile.
pub type RankOf<'a> = &'a (dyn Fn(TileId) -> usize + Sync);

/// How a scene is spread.
#[derive(Clone, Copy)]
pub struct Spread<'a> {
    /// Columns and rows of tiles.
    pub tiles: (u32, u32),
    /// Sync points of a step.
    pub exchange: Exchange,
    /// How many ranks; some may have no tile.
    pub ranks: usize,
    /// Who holds what.
    pub rank_of: RankOf<'a>,
    /// Threads of each rank.
    pub threads: usize,
}

/// One rank's end of the channels to and from all others.
pub struct RankHalo<'a> {
    own: usize,
    rank_of: RankOf<'a>,
    to: Vec<Sender<(Vec<u8>, u128)>>,
    from: Vec<Receiver<(Vec<u8>, u128)>>,
    frames: Frames,
    /// Bytes sent so far.
    pub bytes: usize,
}

impl Halo for RankHalo<'_> {
    type Error = String;

    fn exchange(&mut self, outbox: &mut Outbox, inbox: &mut Inbox) -> Result<(), String> {
        let rank_of = |tile| (self.rank_of)(tile);
        self.frames.deal(outbox, self.to.len(), self.own, &rank_of);
        let word = outbox.verdict().to_word();
        for (rank, &length) in self.frames.lengths().iter().enumerate().filter(|&(rank, _)| rank != self.own) {
            let mut frame = vec![0; length];
            self.frames.encode(outbox, rank, &mut frame);
            self.to[rank].send((frame, word)).map_err(|_| format!("rank {rank} has left"))?;
            self.bytes += length;
        }
        let _ = outbox.deliver(inbox);
        // Against the order of ranks: what arrives first must not matter.
        for rank in (0..self.from.len()).rev().filter(|&rank| rank != self.own) {
            let (frame, word) = self.from[rank].recv().map_err(|_| format!("rank {rank} has left"))?;
            inbox.hear(Verdict::from_word(word));
            if !frame.is_empty() {
                inbox.decode(&frame).map_err(|error| format!("from rank {rank}: {error}"))?;
            }
        }
        Ok(())
    }
}

/// Runs `work` on every rank, each with its own part of the scene, and gives the results by rank.
pub fn run<R: Send>(scene: &Scene, spread: Spread<'_>, work: impl Fn(World, &mut RankHalo<'_>) -> R + Sync) -> Vec<R> {
    let Spread { tiles, exchange, ranks, rank_of, threads } = spread;
    let blueprint = scene.blueprint(tiles, exchange);
    let mut halos: Vec<_> = (0..ranks)
        .map(|own| RankHalo { own, rank_of, to: Vec::new(), from: Vec::new(), frames: Frames::default(), bytes: 0 })
        .collect();
    for from in 0..ranks {
        for to in 0..ranks {
            let (sender, receiver) = channel();
            halos[from].to.push(sender);
            halos[to].from.push(receiver);
        }
    }
    let (blueprint, work) = (&blueprint, &work);
    let one = move |mut halo: RankHalo<'_>| {
        let all = 0..blueprint.partition.tiles() as u32;
        let own: Vec<_> = all.map(TileId).filter(|&tile| rank_of(tile) == halo.own).collect();
        let mut world = World::new(blueprint, &own).expect("a world that can be built");
        for &body in &scene.bodies {
            world.add(body).expect("a body that can be added");
        }
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("threads");
        pool.install(|| work(world, &mut halo))
    };
    thread::scope(|scope| {
        let running: Vec<_> = halos.into_iter().map(|halo| scope.spawn(move || one(halo))).collect();
        running.into_iter().map(|rank| rank.join().expect("no rank panics")).collect()
    })
}
