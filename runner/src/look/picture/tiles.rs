//! The tiles, and which rank has which.

use super::canvas::{Canvas, Form, Letters};
use super::colors;
use super::view::Fit;
use crate::look::frame::{Frame, Setting};
use atoll_core::{Partition, Region, TileId};
use glam::DVec2;

/// Lines nearer than this, in pixels, are not drawn, and from thrice as much on they are drawn fully.
const NEAREST: f64 = 5.0;

/// For each tile the rank that holds it, as far as that can be told: where the run does not say, by the bodies of the frame, of
/// which a few may have left their tile in the last step.
pub(super) fn ranks_of_tiles(setting: &Setting, frame: &Frame, ranks: &mut Vec<Option<u32>>) {
    ranks.clear();
    if let Some(live) = frame.live.as_ref().filter(|live| !live.rank_of_tile.is_empty()) {
        return ranks.extend(live.rank_of_tile.iter().map(|&rank| Some(rank)));
    }
    let partition = frame.partition(setting);
    // Who has the majority of a tile's bodies, if anyone has, is left by the vote of Boyer and Moore.
    let mut votes = vec![(0, 0_u32); partition.tiles()];
    let mut begin = 0;
    for &(rank, end) in &frame.ranks {
        for row in &frame.bodies[begin..end] {
            let vote = &mut votes[partition.locate(DVec2::new(row.x, row.y)).0 as usize];
            match vote {
                (_, 0) => *vote = (rank, 1),
                (holder, lead) if *holder == rank => *lead += 1,
                (_, lead) => *lead -= 1,
            }
        }
        begin = end;
    }
    ranks.extend(votes.into_iter().map(|(rank, lead)| (lead > 0).then_some(rank)));
}

/// Where the edges of tiles are on an image.
#[derive(Clone, Copy, Debug)]
pub(super) struct Edges<'a> {
    partition: &'a Partition,
    fit: &'a Fit,
}

impl<'a> Edges<'a> {
    pub(super) fn new(partition: &'a Partition, fit: &'a Fit) -> Self {
        Self { partition, fit }
    }

    fn tiles(self) -> impl Iterator<Item = TileId> {
        (0..self.partition.tiles() as u32).map(TileId)
    }

    /// Upper left and lower right corner of a tile.
    fn corners(self, tile: TileId) -> [[f64; 2]; 2] {
        let Region { min, max } = self.partition.rectangle(tile);
        [DVec2::new(min.x, max.y), DVec2::new(max.x, min.y)].map(|corner| self.fit.place(corner).map(f64::round))
    }

    /// Width and height of a tile.
    fn size(self, tile: TileId) -> DVec2 {
        self.partition.rectangle(tile).size() * self.fit.scale
    }

    /// Thin lines between tiles. Where they are too small to be seen, they are left out.
    pub(super) fn draw_grid(self, canvas: &mut Canvas, unit: f64) {
        let half = 0.5 * unit.round().max(1.0);
        let part = |tile| 0.4 * ((self.size(tile).min_element() - NEAREST) / (2.0 * NEAREST)).clamp(0.0, 1.0);
        let mut upright = |x: f64, top, bottom, part| {
            canvas.draw(&Form::rectangle([x - half, top], [x + half, bottom]), colors::INK, part)
        };
        let [columns, rows] = self.partition.roots();
        let last = TileId(self.partition.tiles() as u32 - 1);
        let ([[left, _], [_, bottom]], [[_, top], [right, _]]) = (self.corners(TileId(0)), self.corners(last));
        if !self.partition.is_uniform() {
            for tile in self.tiles() {
                let [[x, top], [_, bottom]] = self.corners(tile);
                upright(x, top, bottom, part(tile));
            }
        } else {
            (0..columns).for_each(|column| upright(self.corners(TileId(column))[0][0], top, bottom, part(last)));
        }
        upright(right, top, bottom, part(last));
        let mut level = |y: f64, left, right, part| {
            canvas.draw(&Form::rectangle([left, y - half], [right, y + half]), colors::INK, part)
        };
        if !self.partition.is_uniform() {
            for tile in self.tiles() {
                let [[left, _], [right, y]] = self.corners(tile);
                level(y, left, right, part(tile));
            }
        } else {
            (0..rows).for_each(|row| level(self.corners(TileId(row * columns))[1][1], left, right, part(last)));
        }
        level(top, left, right, part(last));
    }

    /// Along the borders of each rank's tiles a line in its color, on its own side.
    pub(super) fn outline_ranks(self, canvas: &mut Canvas, ranks: &[Option<u32>], unit: f64) {
        let (domain_low, domain_high) = (self.partition.min(), self.partition.max());
        for (tile, rank) in self.tiles().zip(ranks).filter_map(|(tile, rank)| Some((tile, (*rank)?))) {
            let width = (3.0 * unit).min(0.3 * self.size(tile).min_element()).max(1.0);
            let own = self.partition.rectangle(tile);
            let [low, high] = self.corners(tile);
            let mut draw = |low: [f64; 2], high: [f64; 2]| {
                if low[0] < high[0] && low[1] < high[1] {
                    canvas.draw(&Form::rectangle(low, high), colors::distinct(rank), 1.0);
                }
            };
            // Along the part of a side that is before another tile, or before none.
            let mut side = |is_side: [bool; 4], [from, to]: [[f64; 2]; 2]| {
                let ([x, y], [end_x, end_y]) =
                    ([from[0].max(low[0]), from[1].max(low[1])], [to[0].min(high[0]), to[1].min(high[1])]);
                let strips = [
                    ([low[0], y], [low[0] + width, end_y]),
                    ([high[0] - width, y], [high[0], end_y]),
                    ([x, high[1] - width], [end_x, high[1]]),
                    ([x, low[1]], [end_x, low[1] + width]),
                ];
                strips
                    .into_iter()
                    .zip(is_side)
                    .filter(|(_, is_side)| *is_side)
                    .for_each(|((low, high), _)| draw(low, high));
            };
            let at = |min: DVec2, max: DVec2| {
                [own.min.x == max.x, own.max.x == min.x, own.min.y == max.y, own.max.y == min.y]
            };
            let outermost = [
                own.min.x == domain_low.x,
                own.max.x == domain_high.x,
                own.min.y == domain_low.y,
                own.max.y == domain_high.y,
            ];
            side(outermost, [low, high]);
            for other in self.partition.around(tile).filter(|other| ranks[other.0 as usize] != Some(rank)) {
                let Region { min, max } = self.partition.rectangle(other);
                side(at(min, max), self.corners(other));
            }
        }
    }

    /// In the middle of what each rank has, where there is room, which rank it is.
    pub(super) fn name_ranks(self, canvas: &mut Canvas, letters: &Letters, ranks: &[Option<u32>], size: f64) {
        let mut named: Vec<u32> = ranks.iter().flatten().copied().collect();
        named.sort_unstable();
        named.dedup();
        for rank in named {
            let text = format!("rank {rank}");
            let [x, y] = self.middle(ranks, rank);
            let half = [0.5 * letters.width(&text, size) + 0.6 * size, 0.85 * size];
            let of_rank = self.tiles().zip(ranks).filter(|(_, holder)| **holder == Some(rank));
            let area: f64 = of_rank.map(|(tile, _)| self.size(tile).element_product()).sum();
            if area > 6.0 * 4.0 * half[0] * half[1] {
                let (low, high) = ([x - half[0], y - half[1]], [x + half[0], y + half[1]]);
                canvas.draw(&Form::Plate { low, high, radius: half[1] }, colors::PAPER, 0.9);
                let plate = Form::Plate { low, high, radius: half[1] }.grown(-0.08 * size);
                canvas.draw(&plate, colors::distinct(rank).darker(), 1.0);
                let from = [x - half[0] + 0.6 * size, y + 0.36 * size];
                letters.write(canvas, &text, from, size, colors::PAPER);
            }
        }
    }

    /// A point of that tile of a rank which is nearest to the middle of all of them.
    fn middle(self, ranks: &[Option<u32>], rank: u32) -> [f64; 2] {
        let of_rank = || self.tiles().zip(ranks).filter(|(_, holder)| **holder == Some(rank)).map(|(tile, _)| tile);
        let center = |tile| {
            let [low, high] = self.corners(tile);
            0.5 * (DVec2::from(low) + DVec2::from(high))
        };
        let sum = |(sum, area): (DVec2, f64), tile| {
            let own = self.size(tile).element_product();
            (sum + own * center(tile), area + own)
        };
        let (sum, area) = of_rank().fold((DVec2::ZERO, 0.0), sum);
        let mean = sum / area;
        // A tile that holds the mean needs no other place.
        let holds = |tile| (center(tile) - mean).abs().cmple(0.5 * (self.size(tile) + 1.0)).all();
        let nearest =
            of_rank().min_by(|&a, &b| center(a).distance_squared(mean).total_cmp(&center(b).distance_squared(mean)));
        if of_rank().any(holds) { mean.to_array() } else { nearest.map_or(mean, center).to_array() }
    }
}
