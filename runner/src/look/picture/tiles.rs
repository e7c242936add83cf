//! The grid of tiles, and which rank has which.

use super::canvas::{Canvas, Form, Letters};
use super::colors;
use super::view::Fit;
use crate::look::frame::{Frame, Setting};
use atoll_core::TileGrid;
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
    // Who has the majority of a tile's bodies, if anyone has, is left by the vote of Boyer and Moore.
    let mut votes = vec![(0, 0_u32); setting.grid.tiles()];
    let mut begin = 0;
    for &(rank, end) in &frame.ranks {
        for row in &frame.bodies[begin..end] {
            let vote = &mut votes[setting.grid.locate(DVec2::new(row.x, row.y)).0 as usize];
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
#[derive(Debug)]
pub(super) struct Edges {
    columns: Vec<f64>,
    /// From the lowest row of tiles upwards.
    rows: Vec<f64>,
}

impl Edges {
    pub(super) fn new(grid: &TileGrid, fit: &Fit) -> Self {
        let at = |column, row| {
            fit.place(grid.min() + grid.tile_size() * DVec2::new(column as f64, row as f64)).map(f64::round)
        };
        Self {
            columns: (0..=grid.columns()).map(|column| at(column, 0)[0]).collect(),
            rows: (0..=grid.rows()).map(|row| at(0, row)[1]).collect(),
        }
    }

    /// Upper left and lower right corner of a tile.
    fn corners(&self, column: usize, row: usize) -> [[f64; 2]; 2] {
        [[self.columns[column], self.rows[row + 1]], [self.columns[column + 1], self.rows[row]]]
    }

    /// The shortest side of a tile.
    fn shortest(&self) -> f64 {
        let side = |edges: &[f64]| (edges[edges.len() - 1] - edges[0]).abs() / (edges.len() - 1) as f64;
        side(&self.columns).min(side(&self.rows))
    }

    /// Thin lines between tiles. A grid too fine to be seen is left out.
    pub(super) fn draw_grid(&self, canvas: &mut Canvas, unit: f64) {
        let part = 0.4 * ((self.shortest() - NEAREST) / (2.0 * NEAREST)).clamp(0.0, 1.0);
        let half = 0.5 * unit.round().max(1.0);
        let [left, right] = [self.columns[0], self.columns[self.columns.len() - 1]];
        let [bottom, top] = [self.rows[0], self.rows[self.rows.len() - 1]];
        for x in &self.columns {
            canvas.draw(&Form::rectangle([x - half, top], [x + half, bottom]), colors::INK, part);
        }
        for y in &self.rows {
            canvas.draw(&Form::rectangle([left, y - half], [right, y + half]), colors::INK, part);
        }
    }

    /// Along the borders of each rank's tiles a line in its color, on its own side.
    pub(super) fn outline_ranks(&self, canvas: &mut Canvas, ranks: &[Option<u32>], unit: f64) {
        let (columns, rows) = (self.columns.len() - 1, self.rows.len() - 1);
        let width = (3.0 * unit).min(0.3 * self.shortest()).max(1.0);
        for (tile, rank) in ranks.iter().enumerate().filter_map(|(tile, rank)| Some((tile, (*rank)?))) {
            let (column, row) = (tile % columns, tile / columns);
            let [low, high] = self.corners(column, row);
            let is_edge = |is_outermost: bool, other: usize| is_outermost || ranks[other] != Some(rank);
            let strips = [
                (is_edge(column == 0, tile.wrapping_sub(1)), low, [low[0] + width, high[1]]),
                (is_edge(column + 1 == columns, tile + 1), [high[0] - width, low[1]], high),
                (is_edge(row == 0, tile.wrapping_sub(columns)), [low[0], high[1] - width], high),
                (is_edge(row + 1 == rows, tile + columns), low, [high[0], low[1] + width]),
            ];
            for (_, low, high) in strips.into_iter().filter(|(is_edge, ..)| *is_edge) {
                canvas.draw(&Form::rectangle(low, high), colors::distinct(rank), 1.0);
            }
        }
    }

    /// In the middle of what each rank has, where there is room, which rank it is.
    pub(super) fn name_ranks(&self, canvas: &mut Canvas, letters: &Letters, ranks: &[Option<u32>], size: f64) {
        let mut named: Vec<u32> = ranks.iter().flatten().copied().collect();
        named.sort_unstable();
        named.dedup();
        for rank in named {
            let text = format!("rank {rank}");
            let [x, y] = self.middle(ranks, rank);
            let half = [0.5 * letters.width(&text, size) + 0.6 * size, 0.85 * size];
            let area = ranks.iter().filter(|holder| **holder == Some(rank)).count() as f64 * self.area();
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

    /// Of a tile.
    fn area(&self) -> f64 {
        let side = |edges: &[f64]| (edges[edges.len() - 1] - edges[0]).abs() / (edges.len() - 1) as f64;
        side(&self.columns) * side(&self.rows)
    }

    /// The center of that tile of a rank which is nearest to the mean of all of them.
    fn middle(&self, ranks: &[Option<u32>], rank: u32) -> [f64; 2] {
        let columns = self.columns.len() - 1;
        let centers = ranks.iter().enumerate().filter(|(_, holder)| **holder == Some(rank)).map(|(tile, _)| {
            let [low, high] = self.corners(tile % columns, tile / columns);
            DVec2::new(0.5 * (low[0] + high[0]), 0.5 * (low[1] + high[1]))
        });
        let (sum, count) = centers.clone().fold((DVec2::ZERO, 0.0), |(sum, count), center| (sum + center, count + 1.0));
        let mean = sum / count;
        let nearest = centers.min_by(|a, b| a.distance_squared(mean).total_cmp(&b.distance_squared(mean)));
        let nearest = nearest.unwrap_or(mean);
        // A tile that holds the mean needs no other place.
        let holds = (nearest - mean).abs() * 2.0;
        let side = DVec2::new((self.columns[1] - self.columns[0]).abs(), (self.rows[1] - self.rows[0]).abs());
        if holds.cmple(side + 1.0).all() { mean.to_array() } else { nearest.to_array() }
    }
}
