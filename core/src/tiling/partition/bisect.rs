//! Where a domain is cut in two, again and again, so that every tile has as much to do as any other, by exact counts alone.

use super::bisection::{Bisection, Bisector, Block, PARTS, tiles_of_first};
use super::{Cut, Partition, Region};
use crate::model::error::SetupError;
use crate::model::id::TileId;
use bytemuck::{Pod, Zeroable};
use glam::DVec2;

/// What a ghost takes, and a contact that is solved for others, in what a body takes that touches nothing: 150 to 300 ns, and 100 to
/// 300 ns, where a body takes 23 to 35 ns.
pub(crate) const GHOST: u64 = 6;

/// What there is to do in a tile is told of so many columns and rows of equal cells.
const CELLS: usize = 4;

/// A cut stays where it is while it is off by no more than this part of what its first part should have to do.
const TOLERANCE: f64 = 1.0 / 64.0;

/// A cut is where it should be if it is off by no more than this part of what a tile has to do.
const EXACTNESS: f64 = 1.0 / 256.0;

/// More tries to find a place are not made.
const MOST_TRIES: u32 = 40;

/// What another axis would sever must be less than this part of what a cut severs now, for the cut to be turned.
const TURNED: f64 = 0.5;

/// What there is to do in a tile.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Pod, Zeroable)]
#[repr(C)]
pub struct Share {
    /// Which tile.
    pub tile: TileId,
    /// What comes of others' bodies, in bodies that touch nothing.
    pub others: u32,
    /// What comes of its own, in each of the cells that its rectangle is cut into, row by row. What is beyond counts in the cell next
    /// to it.
    pub load: [u32; CELLS * CELLS],
}

/// Adds up what there is to do in the tiles of a bisection.
pub(crate) struct Counter {
    /// Of each tile.
    shares: Vec<Share>,
    /// The tile of the last place.
    tile: TileId,
    /// Its region, its low corner, and how many cells there are to a meter.
    region: Region,
    corner: DVec2,
    per_meter: DVec2,
}

impl Counter {
    pub(crate) fn new(partition: &Partition) -> Self {
        let tiles = 0..partition.tiles() as u32;
        let shares = tiles.map(|tile| Share { tile: TileId(tile), others: 0, load: [0; CELLS * CELLS] }).collect();
        let nowhere = Region { min: DVec2::INFINITY, max: DVec2::NEG_INFINITY };
        Self { shares, tile: TileId(0), region: nowhere, corner: DVec2::ZERO, per_meter: DVec2::ZERO }
    }

    /// Adds something to do at a place.
    #[inline]
    pub(crate) fn add(&mut self, partition: &Partition, place: DVec2, load: u64) {
        if !self.region.contains(place) {
            self.tile = partition.locate(place);
            let rectangle = partition.rectangle(self.tile);
            (self.region, self.corner) = (partition.region(self.tile), rectangle.min);
            self.per_meter = CELLS as f64 / rectangle.size();
        }
        let [column, row] = ((place - self.corner) * self.per_meter).to_array();
        let within = |cell: f64| (cell as usize).min(CELLS - 1);
        let sum = &mut self.shares[self.tile.0 as usize].load[within(row) * CELLS + within(column)];
        *sum = sum.saturating_add(load as u32);
    }

    /// Adds what comes of others' bodies to what a tile has to do.
    pub(crate) fn add_others(&mut self, tile: TileId, load: u64) {
        let sum = &mut self.shares[tile.0 as usize].others;
        *sum = sum.saturating_add(load as u32);
    }

    /// Those of tiles that have something to do.
    pub(crate) fn shares(mut self) -> Vec<Share> {
        self.shares.retain(|share| share.others > 0 || share.load.iter().any(|&load| load > 0));
        self.shares
    }
}

impl Share {
    /// Those of all tiles, ascending, from some of each, in any order.
    pub fn added_up(tiles: usize, some: impl Iterator<Item = Self>) -> Option<Vec<Self>> {
        let mut all: Vec<Self> =
            (0..tiles as u32).map(|tile| Self { tile: TileId(tile), others: 0, load: [0; CELLS * CELLS] }).collect();
        for share in some {
            let sums = all.get_mut(share.tile.0 as usize)?;
            sums.others = sums.others.saturating_add(share.others);
            sums.load.iter_mut().zip(share.load).for_each(|(sum, load)| *sum = sum.saturating_add(load));
        }
        Some(all)
    }
}

/// Whether cuts are made across another axis than before, where that severs less.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Turning {
    /// They are not.
    Never,
    /// They are.
    May,
    /// They have just been, so that nothing is known of others' bodies: all cuts are made anew, and none is turned.
    Has,
}

/// Something to do, spread evenly over a rectangle, or at a point, in parts of the domain.
#[derive(Clone, Copy, Debug)]
struct Piece {
    min: [f64; 2],
    max: [f64; 2],
    /// One over the size; a point has next to none.
    per_part: [f64; 2],
    load: f64,
}

impl Piece {
    fn new(min: [f64; 2], max: [f64; 2], load: f64) -> Self {
        let per_part = [0, 1].map(|axis| 1.0 / (max[axis] - min[axis]).max(1e-6));
        Self { min, max, per_part, load }
    }

    /// What of it lies before a place on an axis.
    #[inline(always)]
    fn before(&self, axis: usize, at: f64) -> f64 {
        self.load * ((at - self.min[axis]) * self.per_part[axis]).clamp(0.0, 1.0)
    }

    /// What of it lies before a place on an axis.
    fn part_before(&self, axis: usize, at: f64) -> Option<Self> {
        if self.max[axis] <= at {
            return Some(*self);
        }
        let mut max = self.max;
        max[axis] = at;
        (self.min[axis] < at).then(|| Self::new(self.min, max, self.before(axis, at)))
    }

    /// What of it lies from a place on an axis on.
    fn part_behind(&self, axis: usize, at: f64) -> Option<Self> {
        if self.min[axis] >= at {
            return Some(*self);
        }
        let mut min = self.min;
        min[axis] = at;
        (self.max[axis] > at).then(|| Self::new(min, self.max, self.load - self.before(axis, at)))
    }
}

/// What there is to do in a block.
struct Pieces {
    all: Vec<Piece>,
    total: f64,
    /// From where to where there is any, along either axis.
    extent: [[f64; 2]; 2],
}

impl Pieces {
    fn new(mut all: Vec<Piece>) -> Self {
        all.retain(|piece| piece.load > 0.0);
        let mut pieces = Self { all, total: 0.0, extent: [[f64::INFINITY, f64::NEG_INFINITY]; 2] };
        for piece in &pieces.all {
            pieces.total += piece.load;
            for (axis, [min, max]) in pieces.extent.iter_mut().enumerate() {
                (*min, *max) = (min.min(piece.min[axis]), max.max(piece.max[axis]));
            }
        }
        pieces
    }

    /// All that there is to do before a place on an axis.
    fn before(&self, axis: usize, at: f64) -> f64 {
        // Four sums: none has to wait for the last.
        let (fours, rest) = self.all.as_chunks::<4>();
        let mut sums = [0.0; 4];
        for four in fours {
            (0..4).for_each(|i| sums[i] += four[i].before(axis, at));
        }
        sums.iter().sum::<f64>() + rest.iter().map(|piece| piece.before(axis, at)).sum::<f64>()
    }

    /// Where on an axis to cut, so that the first part has a share of what both have to do, to some exactness: either has what lies
    /// within a halo of it as well. Between two places of which one is on either side, a straight line leads to the next, and the side
    /// that stays is drawn in (the method of Illinois: M. Dowell, P. Jarratt, "A modified regula falsi method for computing the root
    /// of an equation", 1971).
    fn place(&self, axis: usize, share: f64, halo: f64, exactness: f64, guess: Option<f64>) -> f64 {
        let [mut low, mut high] = self.extent[axis];
        let (mut off_low, mut off_high) = (-share * self.total, (1.0 - share) * self.total);
        let mut at = guess.filter(|guess| (low..high).contains(guess));
        let mut last_is_low = None;
        for _ in 0..MOST_TRIES {
            let here =
                at.take().unwrap_or_else(|| low + (high - low) * (off_low / (off_low - off_high)).clamp(0.02, 0.98));
            let (first, second) = (self.before(axis, here + halo), self.total - self.before(axis, here - halo));
            let off = (1.0 - share) * first - share * second;
            if off.abs() <= exactness || high - low <= 1.0 {
                return here;
            }
            let is_low = off < 0.0;
            let stays = if is_low {
                (low, off_low) = (here, off);
                &mut off_high
            } else {
                (high, off_high) = (here, off);
                &mut off_low
            };
            if last_is_low == Some(is_low) {
                *stays *= 0.5;
            }
            last_is_low = Some(is_low);
        }
        0.5 * (low + high)
    }
}

/// The first of the cuts of a bisection, and those of its two parts.
fn parts(cuts: &[Bisector]) -> Option<(Bisector, [&[Bisector]; 2])> {
    let (&cut, rest) = cuts.split_first()?;
    let (low, high) = rest.split_at(tiles_of_first(cuts.len() + 1) - 1);
    Some((cut, [low, high]))
}

/// Cuts a domain.
struct Knife {
    /// The width of the halo along either axis, in parts of the domain.
    halo: [f64; 2],
    /// Whether a cut may be made along another axis than before.
    may_turn: bool,
    /// Whether any was.
    has_turned: bool,
    cuts: Vec<Bisector>,
}

impl Knife {
    fn new(halo_width: f64, size: DVec2, may_turn: bool) -> Self {
        let halo = (halo_width / size * PARTS as f64).to_array();
        Self { halo, may_turn, has_turned: false, cuts: Vec::new() }
    }

    /// Cuts a block into the tiles that it had, with what each has to do, as pieces in the order of the tiles. Cuts stay where they
    /// are while they will do.
    fn adjust(&mut self, block: Block, loads: &[f64], pieces: &[Piece], old: &[Bisector]) {
        let Some((cut, rest)) = parts(old) else { return };
        let first = tiles_of_first(loads.len());
        let (low, high) = loads.split_at(first);
        let sums = [low, high].map(|loads| loads.iter().sum::<f64>());
        let goal = (sums[0] + sums[1]) * (first as f64 / loads.len() as f64);
        if (sums[0] - goal).abs() > TOLERANCE * goal {
            return self.cut(block, loads.len(), Pieces::new(pieces.to_vec()), old);
        }
        self.cuts.push(cut);
        let halves = block.cut(cut).expect("cuts that were made can be made");
        let pieces = pieces.split_at(first * CELLS * CELLS);
        self.adjust(halves[0], low, pieces.0, rest[0]);
        self.adjust(halves[1], high, pieces.1, rest[1]);
    }

    /// Cuts a block into so many tiles. `old` are cuts into as many of what was about the same block, or none.
    fn cut(&mut self, block: Block, tiles: usize, pieces: Pieces, old: &[Bisector]) {
        if tiles == 1 {
            return;
        }
        let first = tiles_of_first(tiles);
        let known = parts(old);
        let cut = self.best_cut(block, first, tiles, &pieces, known.map(|(cut, _)| cut));
        self.cuts.push(cut);
        let (axis, at) = (cut.axis as usize, f64::from(cut.at));
        let halo = self.halo[axis];
        let low = pieces.all.iter().filter_map(|piece| piece.part_before(axis, at + halo)).collect();
        let high = pieces.all.iter().filter_map(|piece| piece.part_behind(axis, at - halo)).collect();
        drop(pieces);
        let rest = known.filter(|(known, _)| known.axis == cut.axis).map_or([&[][..]; 2], |(_, rest)| rest);
        let halves = block.cut(cut).expect("it lies within");
        self.cut(halves[0], first, Pieces::new(low), rest[0]);
        self.cut(halves[1], tiles - first, Pieces::new(high), rest[1]);
    }

    /// The cut of a block that gives each part of its tiles what is due, across the axis where least lies within a halo of it.
    fn best_cut(
        &mut self,
        block: Block,
        first: usize,
        tiles: usize,
        pieces: &Pieces,
        known: Option<Bisector>,
    ) -> Bisector {
        let sides = [0, 1].map(|axis| block.max[axis] - block.min[axis]);
        // Each part must be able to be cut as often as it will be.
        let fits = |axis: usize| sides[axis] >= tiles as u64;
        let longer = usize::from(sides[1] > sides[0]);
        if pieces.total <= 0.0 {
            let at = block.min[longer] + sides[longer] / tiles as u64 * first as u64;
            return Bisector { axis: longer as u32, at: at as u32 };
        }
        let (tile, share) = (pieces.total / tiles as f64, first as f64 / tiles as f64);
        let place = |axis: usize| {
            let guess = known.filter(|known| known.axis == axis as u32).map(|known| f64::from(known.at));
            let at = pieces.place(axis, share, self.halo[axis], EXACTNESS * tile, guess);
            let (least, most) = (block.min[axis] + first as u64, block.max[axis] - (tiles - first) as u64);
            Bisector { axis: axis as u32, at: (at.round() as u64).clamp(least, most) as u32 }
        };
        let severed = |cut: Bisector| {
            let (axis, at) = (cut.axis as usize, f64::from(cut.at));
            pieces.before(axis, at + self.halo[axis]) - pieces.before(axis, at - self.halo[axis])
        };
        if !(fits(0) && fits(1)) {
            return place(longer);
        }
        match known {
            Some(known) => {
                let cut = place(known.axis as usize);
                let other = self.may_turn.then(|| place(1 - known.axis as usize));
                let better = other.filter(|other| severed(*other) < TURNED * severed(cut));
                self.has_turned |= better.is_some();
                better.unwrap_or(cut)
            }
            None => {
                let [x, y] = [0, 1].map(place);
                if severed(y) < severed(x) { y } else { x }
            }
        }
    }
}

impl Partition {
    /// Cuts the rectangle from `min` to `max` in two again and again, as a list of cuts has it in which each comes before those of
    /// its parts, the lower first: of so many tiles as are left, half, rounded down, lie in the lower part. Tiles are counted in that
    /// order.
    ///
    /// # Errors
    /// If a cut does not lie within what it cuts, or a part would have no width.
    pub fn bisection(min: DVec2, max: DVec2, cuts: &[Bisector]) -> Result<Self, SetupError> {
        Bisection::new(min, max, cuts).map(|bisection| Self(Cut::Bisection(bisection)))
    }

    /// Cuts the rectangle into so many tiles of as much to do each, whose halos are so wide, in meters. `bodies` gives places, and for
    /// how many bodies each of them stands.
    ///
    /// # Errors
    /// If that makes no tiles.
    pub fn bisected(
        min: DVec2,
        max: DVec2,
        tiles: u32,
        halo_width: f64,
        bodies: impl Iterator<Item = (DVec2, u64)>,
    ) -> Result<Self, SetupError> {
        let (size, all) = (max - min, DVec2::splat(PARTS as f64));
        let point = |(place, bodies): (DVec2, u64)| {
            let at = ((place - min) / size * all).clamp(DVec2::ZERO, all).to_array();
            Piece::new(at, at, bodies as f64)
        };
        let mut knife = Knife::new(halo_width, size, false);
        knife.cut(Block::ALL, tiles.max(1) as usize, Pieces::new(bodies.map(point).collect()), &[]);
        Self::bisection(min, max, &knife.cuts)
    }

    /// What becomes of a [`bisection`](Self::bisection) by what there is to do in all its tiles, ascending, whose halos are so wide, in
    /// meters: as many tiles, cut so that all have as much to do. It is said whether any cut was turned: then what lies in the tiles is
    /// hardly known, and should be counted again.
    ///
    /// # Errors
    /// If those are not the shares of all tiles.
    pub fn rebisected(
        &self,
        shares: &[Share],
        halo_width: f64,
        turning: Turning,
    ) -> Result<Option<(Self, bool)>, SetupError> {
        let Cut::Bisection(bisection) = &self.0 else { return Ok(None) };
        let (blocks, mut knife) =
            (bisection.blocks(), Knife::new(halo_width, self.max() - self.min(), turning == Turning::May));
        if shares.len() != blocks.len() || !(0..).zip(shares).all(|(tile, share)| share.tile == TileId(tile)) {
            return Err(SetupError::BadBisection { cut: 0 });
        }
        let mut pieces = Vec::with_capacity(shares.len() * CELLS * CELLS);
        for (share, block) in shares.iter().zip(blocks) {
            let edge = |axis: usize, cell: usize| {
                let (min, max) = (block.min[axis] as f64, block.max[axis] as f64);
                min + (max - min) * (cell as f64 / CELLS as f64)
            };
            pieces.extend((0..).zip(share.load).map(|(cell, load)| {
                let (column, row) = (cell % CELLS, cell / CELLS);
                let (min, max) = ([edge(0, column), edge(1, row)], [edge(0, column + 1), edge(1, row + 1)]);
                Piece::new(min, max, f64::from(load))
            }));
        }
        if turning == Turning::Has {
            knife.cut(Block::ALL, blocks.len(), Pieces::new(pieces), bisection.cuts());
        } else {
            let load = |share: &Share| f64::from(share.others) + share.load.iter().copied().map(f64::from).sum::<f64>();
            let loads: Vec<f64> = shares.iter().map(load).collect();
            knife.adjust(Block::ALL, &loads, &pieces, bisection.cuts());
        }
        if knife.cuts == bisection.cuts() {
            return Ok(None);
        }
        Ok(Some((Self::bisection(self.min(), self.max(), &knife.cuts)?, knife.has_turned)))
    }
}
