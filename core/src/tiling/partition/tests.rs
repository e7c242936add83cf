//! Owners and regions against each other and against trying every tile.

use super::TileGrid;
use crate::model::error::SetupError;
use crate::model::id::TileId;
use crate::testing::cases;
use glam::{DVec2, Vec2};
use proptest::prelude::*;

fn any_grid() -> impl Strategy<Value = TileGrid> {
    let low = prop_oneof![Just(0.0), -1e3..1e3, -1e9..1e9];
    let size = (-2.0_f64..6.0).prop_map(|exponent| 10.0_f64.powf(exponent));
    (low.clone(), low, size.clone(), size, 1_u32..=40, 1_u32..=40).prop_filter_map(
        "tiles without a width",
        |(x, y, width, height, columns, rows)| {
            let min = DVec2::new(x, y);
            TileGrid::new(min, min + DVec2::new(width, height), columns, rows).ok()
        },
    )
}

fn tiles(grid: &TileGrid) -> impl Iterator<Item = TileId> + use<> {
    (0..grid.tiles() as u32).map(TileId)
}

/// One coordinate: anywhere, outside, or exactly upon or right beside one of the edges.
fn coordinate(edges: &[f64], pick: prop::sample::Index, part: f64, how: u8) -> f64 {
    let (low, high) = (edges[0], edges[edges.len() - 1]);
    let edge = *pick.get(edges);
    match how {
        0 => edge,
        1 => edge.next_up(),
        2 => edge.next_down(),
        3 => low + (high - low) * (3.0 * part - 1.0),
        _ => low + (high - low) * part,
    }
}

fn any_point_in(grid: TileGrid) -> impl Strategy<Value = (TileGrid, DVec2)> {
    let axis = (any::<prop::sample::Index>(), 0.0..1.0, 0_u8..8);
    (axis.clone(), axis).prop_map(move |((px, x, how_x), (py, y, how_y))| {
        let edges = |low: f64, high: f64, count: usize| -> Vec<f64> {
            let region = |i: usize| {
                if i == 0 {
                    low
                } else if i == count {
                    high
                } else {
                    f64::NAN
                }
            };
            (0..=count).map(region).collect()
        };
        let mut columns = edges(grid.min().x, grid.max().x, grid.columns());
        let mut rows = edges(grid.min().y, grid.max().y, grid.rows());
        for (i, edge) in columns.iter_mut().enumerate().skip(1).take(grid.columns() - 1) {
            *edge = grid.region(TileId(i as u32)).min.x;
        }
        for (i, edge) in rows.iter_mut().enumerate().skip(1).take(grid.rows() - 1) {
            *edge = grid.region(TileId((i * grid.columns()) as u32)).min.y;
        }
        (grid.clone(), DVec2::new(coordinate(&columns, px, x, how_x), coordinate(&rows, py, y, how_y)))
    })
}

proptest! {
    #![proptest_config(cases(512))]

    #[test]
    fn every_point_belongs_to_the_tile_that_contains_it((grid, point) in any_grid().prop_flat_map(any_point_in)) {
        let owner = grid.locate(point);
        let containing: Vec<_> = tiles(&grid).filter(|&tile| grid.region(tile).contains(point)).collect();
        prop_assert_eq!(containing, vec![owner]);
    }

    #[test]
    fn a_box_reaches_the_tiles_that_it_meets(
        (grid, point) in any_grid().prop_flat_map(any_point_in),
        half in (0.0_f32..1.0, 0.0_f32..1.0),
        reach in 0.0_f64..0.3,
    ) {
        // Some tiles wide.
        let half = Vec2::new(half.0, half.1) * grid.tile_size().as_vec2() * 3.0;
        let reach = reach * grid.tile_size().x;
        let grown = half.as_dvec2() + DVec2::splat(reach);
        let (low, high) = (point - grown, point + grown);
        let meets = |tile: &TileId| {
            let region = grid.region(*tile);
            low.x < region.max.x && high.x >= region.min.x && low.y < region.max.y && high.y >= region.min.y
        };
        let reached: Vec<_> = grid.reached(point, half, reach).collect();
        prop_assert_eq!(&reached, &tiles(&grid).filter(meets).collect::<Vec<_>>());
        prop_assert!(reached.contains(&grid.locate(point)));
    }
}

#[test]
fn what_is_no_point_belongs_to_some_tile_all_the_same() {
    let grid = TileGrid::new(DVec2::ZERO, DVec2::new(4.0, 3.0), 4, 3).unwrap();
    let (inf, nan) = (f64::INFINITY, f64::NAN);
    for (x, y, tile) in [
        (inf, inf, 11),
        (-inf, -inf, 0),
        (-inf, inf, 8),
        (inf, 1.5, 7),
        (f64::MAX, f64::MIN, 3),
        (nan, 1.5, 4),
        (2.5, nan, 2),
        (nan, nan, 0),
    ] {
        assert_eq!(grid.locate(DVec2::new(x, y)), TileId(tile), "({x}, {y})");
    }
    assert!(tiles(&grid).all(|tile| !grid.region(tile).contains(DVec2::new(nan, 1.0))));
    // Nor does a box without bounds break anything: it reaches everywhere.
    assert_eq!(grid.reached(DVec2::ONE, Vec2::splat(f32::INFINITY), 0.0).count(), 12);
}

#[test]
fn regions_are_half_open_and_share_their_edges() {
    let grid = TileGrid::new(DVec2::new(-1.0, 2.0), DVec2::new(1.1, 3.3), 7, 5).unwrap();
    for row in 0..5 {
        for column in 0..7 {
            let region = |column: u32, row: u32| grid.region(TileId(row * 7 + column));
            let own = region(column, row);
            let right = if column < 6 { region(column + 1, row).min.x } else { f64::INFINITY };
            let above = if row < 4 { region(column, row + 1).min.y } else { f64::INFINITY };
            assert_eq!((own.max.x, own.max.y), (right, above));
            if column > 0 && row > 0 {
                assert!(own.contains(own.min));
                assert_eq!(grid.corner(TileId(row * 7 + column)), own.min);
            }
        }
    }
    assert_eq!(grid.region(TileId(0)).min, DVec2::splat(f64::NEG_INFINITY));
    assert_eq!(grid.corner(TileId(0)), grid.min());
}

#[test]
fn grids_without_sense_are_refused() {
    let refused = |min: DVec2, max: DVec2, columns, rows| match TileGrid::new(min, max, columns, rows) {
        Err(error @ SetupError::BadGrid { .. }) => error.to_string(),
        other => panic!("{other:?}"),
    };
    let (zero, one) = (DVec2::ZERO, DVec2::ONE);
    assert!(refused(zero, one, 0, 1).contains("at least one column"));
    assert!(refused(zero, one, 3, 0).contains("3 x 0 tiles"));
    assert!(refused(one, zero, 1, 1).contains("above its minimum"));
    assert!(refused(zero, DVec2::new(1.0, 0.0), 1, 1).contains("above its minimum"));
    assert!(refused(zero, DVec2::new(f64::NAN, 1.0), 1, 1).contains("finite"));
    assert!(refused(zero, DVec2::new(f64::INFINITY, 1.0), 1, 1).contains("finite"));
    assert!(refused(zero, one, u32::MAX, 2).contains("2^32"));
    // A million columns between two neighbouring numbers have no width.
    let far = DVec2::splat(1e15);
    assert!(refused(far, far + one, 1_000_000, 1).contains("width"));
}
