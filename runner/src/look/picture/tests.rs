//! Pictures judged by their pixels.

use super::canvas::{Canvas, Field, Form, Letters, Rgb, Tone};
use super::labels::{Labels, scale_bar};
use super::legend::{Legend, grouped, length};
use super::paint::round_up;
use super::*;
use crate::folder::recording::Row;
use crate::look::frame::Live;
use atoll_core::{GlobalId, Kind, Material, Part, Partition, Path, Rot, Segment, Shape, StaticBody, Travel};
use glam::DVec2;

/// One pixel is a meter wide: a domain as large as the image, and its view.
const SIZE: u32 = 400;

fn kind(shape: Shape) -> Kind {
    Kind::new(shape, Material::default())
}

fn setting(kinds: &[Shape], statics: &[(Shape, f32, DVec2)]) -> Setting {
    let fixed = |(id, (shape, angle, position)): (u64, &(Shape, f32, DVec2))| StaticBody {
        rotation: Rot::from_angle(*angle),
        ..StaticBody::new(GlobalId(id), kind(shape.clone()), *position)
    };
    Setting {
        partition: Partition::uniform(DVec2::ZERO, DVec2::splat(f64::from(SIZE)), 4, 4).unwrap(),
        kinds: kinds.iter().map(|shape| kind(shape.clone())).collect(),
        names: Vec::new(),
        statics: (0..).zip(statics).map(fixed).collect(),
        hertz: 60.0,
    }
}

fn frame(bodies: Vec<Row>) -> Frame {
    Frame { step: 120, ranks: vec![(0, bodies.len())], bodies, tiling: None, live: None }
}

fn row(kind: u32, x: f64, y: f64, angle: f32) -> Row {
    Row { kind, x, y, angle, ..Row::default() }
}

fn look(color: ColorBy) -> Look {
    Look { size: [SIZE; 2], color, layers: Layers::default(), bare: true }
}

fn view() -> View {
    View { low: DVec2::ZERO, high: DVec2::splat(f64::from(SIZE)) }
}

/// What is drawn of a world right of its labels.
fn right_of_labels(setting: &Setting, frame: &Frame, look: Look) -> Vec<[u8; 3]> {
    let mut painter = Painter::new(setting, look);
    let image = painter.draw(frame, &view());
    let rows = image.pixels.as_chunks::<3>().0.chunks(image.size[0] as usize);
    rows.flat_map(|row| row[150..].to_vec()).collect()
}

/// How much is not paper, each pixel by how near it is to a color.
fn area(pixels: &[[u8; 3]], color: Rgb) -> f64 {
    let paper = colors::PAPER.0.map(f64::from);
    let ink = color.0.map(f64::from);
    let widest = (0..3).max_by(|a, b| (paper[*a] - ink[*a]).abs().total_cmp(&(paper[*b] - ink[*b]).abs())).unwrap();
    let part = |pixel: &[u8; 3]| (paper[widest] - f64::from(pixel[widest])) / (paper[widest] - ink[widest]);
    pixels.iter().map(part).sum()
}

fn assert_near(found: f64, expected: f64, what: &str) {
    assert!((found / expected - 1.0).abs() < 0.02, "{what}: {found} and not {expected}");
}

#[test]
fn forms_cover_their_area_at_every_scale() {
    for size in [3.0, 4.4, 7.0, 19.3, 60.0, 144.0, 300.0] {
        let mut canvas = Canvas::new([SIZE; 2]);
        canvas.unclip();
        let ink = Rgb::hex(0x2F74B5);
        let mut drawn = |form: &Form| {
            canvas.fill(colors::PAPER);
            canvas.draw(form, ink, 1.0);
            area(canvas.image.pixels.as_chunks::<3>().0, ink)
        };
        for shift in [0.0, 0.31, 0.5, 0.77] {
            let center = [200.0 + shift, 199.0 - 0.6 * shift];
            let disc = Form::Disc { center, radius: 0.5 * size };
            assert_near(drawn(&disc), std::f64::consts::PI * 0.25 * size * size, &format!("{disc:?}"));
            for angle in [0.0_f32, 0.3, 0.785, 1.2] {
                let rotation = Rot::from_angle(angle);
                let axis = [f64::from(rotation.c), f64::from(rotation.s)];
                let turned = Form::Box { center, axis, half: [0.5 * size, 0.3 * size] };
                assert_near(drawn(&turned), 0.6 * size * size, &format!("{turned:?}"));
            }
        }
    }
}

#[test]
fn bodies_have_their_areas_and_colors() {
    // Outlines and marks are darker, so how much is not paper is at least the area, and what is seen first is the color.
    for (shape, angle) in [
        (Shape::rectangle(4.0, 3.0), 0.0),
        (Shape::rectangle(4.0, 3.0), 0.6),
        (Shape::circle(1.6), 0.0),
        (Shape::rectangle(60.0, 40.0), 0.0),
        (Shape::rectangle(60.0, 40.0), 1.0),
        (Shape::circle(50.0), 0.0),
    ] {
        let world = setting(std::slice::from_ref(&shape), &[]);
        let pixels = right_of_labels(&world, &frame(vec![row(0, 280.3, 200.6, angle)]), look(ColorBy::Kind));
        let color = colors::distinct(0);
        let covered: f64 = pixels.iter().map(|pixel| area(&[*pixel], color).min(1.0)).sum();
        assert_near(covered, f64::from(shape.area()), &format!("{shape:?} turned by {angle}"));
        assert!(pixels.contains(&color.0), "{shape:?}");
        let dark = pixels.contains(&color.darker().0);
        assert_eq!(dark, shape.area() > 1000.0, "{shape:?} has an outline if it is large");
    }
}

fn polygon(points: &[(f32, f32)], radius: f32) -> Shape {
    Shape::polygon(&points.iter().map(|&(x, y)| glam::Vec2::new(x, y)).collect::<Vec<_>>(), radius).unwrap()
}

#[test]
fn every_shape_is_drawn_as_what_it_is() {
    let part = |shape, x: f32, y: f32| Part { shape, position: glam::Vec2::new(x, y), rotation: Rot::from_angle(0.3) };
    let apart =
        Shape::compound(vec![part(Shape::circle(12.0), -30.0, 0.0), part(Shape::rectangle(30.0, 20.0), 25.0, 5.0)]);
    for shape in [
        polygon(&[(0.0, 0.0), (40.0, 0.0), (10.0, 30.0)], 0.0),
        polygon(&[(0.0, 0.0), (8.0, 0.0), (2.0, 6.0)], 0.0),
        polygon(&[(0.0, 0.0), (40.0, 0.0), (10.0, 30.0)], 6.0),
        Shape::capsule(50.0, 8.0).unwrap(),
        Shape::capsule(6.0, 1.5).unwrap(),
        apart.unwrap(),
    ] {
        for angle in [0.0, 0.7, 2.5] {
            let world = setting(std::slice::from_ref(&shape), &[]);
            let row = row(0, 280.3, 200.6, angle);
            // What kinds are is too long a label.
            let pixels = right_of_labels(&world, &frame(vec![row]), look(ColorBy::Rank));
            let color = colors::distinct(0);
            let covered: f64 = pixels.iter().map(|pixel| area(&[*pixel], color).min(1.0)).sum();
            assert_near(covered, f64::from(shape.area()), &format!("{shape:?} turned by {angle}"));
            // The pixels lie where the shape does: their mean is its center of mass.
            let (mut sum, width) = ([0.0; 2], SIZE as usize - 150);
            for (i, pixel) in pixels.iter().enumerate() {
                let part = area(&[*pixel], color).min(1.0) / covered;
                sum[0] += part * ((i % width) as f64 + 150.5);
                sum[1] += part * (f64::from(SIZE) - (i / width) as f64 - 0.5);
            }
            let off = (DVec2::from(sum) - DVec2::new(row.x, row.y)).length();
            assert!(off < 0.3, "{shape:?} turned by {angle} is {off} pixels off");
        }
    }
}

#[test]
fn segments_and_what_moves_are_where_they_are() {
    let (segment, _) = Segment::new(None, glam::Vec2::ZERO, glam::Vec2::new(100.0, 0.0), None).unwrap();
    let mut world = setting(&[], &[(Shape::Segment(segment), 0.2, DVec2::new(275.0, 200.0))]);
    let drawn = |world: &Setting, step| {
        let pixels = right_of_labels(world, &Frame { step, ..frame(Vec::new()) }, look(ColorBy::Kind));
        (area(&pixels, colors::STATIC), pixels)
    };
    let (covered, _) = drawn(&world, 0);
    assert!((100.0..103.0).contains(&covered), "a pixel wide: {covered}");
    let box_at = |x| [(Shape::rectangle(20.0, 20.0), 0.0, DVec2::new(x, 200.0))];
    world = setting(&[], &box_at(200.0));
    world.statics[0].path = Some(Path { travel: Travel::Line { velocity: DVec2::new(60.0, 0.0) }, turning: 0.0 });
    // A second at 60 steps in it.
    assert_eq!(drawn(&world, 60).1, drawn(&setting(&[], &box_at(260.0)), 60).1);
    assert_ne!(drawn(&world, 0).1, drawn(&world, 60).1);
}

#[test]
fn what_never_moves_is_seen_however_thin() {
    let at = DVec2::new(275.0, 200.0);
    let drawn = |statics: &[(Shape, f32, DVec2)]| {
        area(&right_of_labels(&setting(&[], statics), &frame(Vec::new()), look(ColorBy::Kind)), colors::STATIC)
    };
    assert_near(drawn(&[(Shape::rectangle(200.0, 9.0), 0.0, at)]), 1800.0, "a wall");
    assert_near(drawn(&[(Shape::rectangle(200.0, 9.0), 0.4, at)]), 1800.0, "an incline");
    assert_near(drawn(&[(Shape::rectangle(200.0, 0.01), 0.0, at + 0.3)]), 200.0, "a thin wall");
    // Two that adjoin within a pixel leave no seam.
    let (left, right) = (at - DVec2::new(50.3, 0.0), at + DVec2::new(49.7, 0.0));
    let halves = [(Shape::rectangle(100.0, 9.0), 0.0, left), (Shape::rectangle(100.0, 9.0), 0.0, right)];
    assert_near(drawn(&halves), 1800.0, "two walls");
}

#[test]
fn densities_are_what_bodies_cover() {
    // A quarter of each pixel, wherever within pixels bodies lie.
    let shape = Shape::rectangle(0.5, 0.5);
    let world = setting(std::slice::from_ref(&shape), &[]);
    let places = (0..SIZE * SIZE).map(|i| (f64::from(i % SIZE) + 0.37, f64::from(i / SIZE) + 0.81));
    let bodies: Vec<Row> = places.map(|(x, y)| row(0, x, y, 0.3)).collect();
    let fit = Fit::within(&view(), [[0.0; 2], [f64::from(SIZE); 2]], f64::from(SIZE));
    let drawn = Bodies::new(fit, &world.kinds, f64::from(SIZE * SIZE), bodies.len());
    let mut field = Field::default();
    field.reset([SIZE; 2]);
    bodies.iter().for_each(|row| drawn.splat(&mut field, row, || Rgb::hex(0)));
    assert_near(field.area(), f64::from(SIZE * SIZE) * 0.25, "a density");
    let pixels = right_of_labels(&world, &frame(bodies), look(ColorBy::Kind));
    let middle = pixels[pixels.len() / 2 + 100];
    assert_near(area(&[middle], colors::distinct(0)), f64::from(drawn.tone().of(0.25)), "its tone");
    // Small and large ones cover no pixel twice.
    for width in [0.1, 0.9, 1.4, 1.99] {
        field.reset([SIZE; 2]);
        for i in 0..100 {
            field.splat([20.0 + 3.6 * f64::from(i), 20.0 + 3.1 * f64::from(i)], width * width, Rgb::hex(0));
        }
        assert_near(field.area(), 100.0 * width * width, "bodies apart");
        assert!(field.most() <= 1.0 + 1e-6, "{width}");
    }
    // What is on the edge is there by half, and far away there is nothing.
    field.reset([SIZE; 2]);
    for place in [[0.0, 50.0], [-1e12, 3.0], [f64::NAN, 1.0], [3.0, f64::INFINITY]] {
        field.splat(place, 1.0, Rgb::hex(0));
    }
    assert_near(field.area(), 0.5, "half a body");
    // A form beyond the image leaves nothing to clear.
    let beyond = Form::Disc { center: [9.0, f64::from(2 * SIZE)], radius: 2.0 };
    field.cover(&Canvas::new([SIZE; 2]), &beyond, Rgb::hex(0));
    field.reset([SIZE; 2]);
    assert_eq!(field.area(), 0.0);
}

#[test]
fn one_sees_through_sensors_and_what_is_tiny_or_thin_is_seen() {
    let mut world = setting(&[Shape::rectangle(40.0, 40.0), Shape::circle(0.01), Shape::rectangle(100.0, 0.01)], &[]);
    world.kinds[0].sensor = true;
    let drawn = |kind| right_of_labels(&world, &frame(vec![row(kind, 280.0, 200.0, 0.0)]), look(ColorBy::Rank));
    let ink = colors::distinct(0);
    let sheer = area(&drawn(0), ink);
    assert!((SHEER * 1600.0..0.6 * 1600.0).contains(&sheer), "{sheer} of 1600");
    let [tiny, thin] = [1, 2].map(|kind| area(&drawn(kind), ink));
    assert!((0.7..2.0).contains(&tiny) && (99.0..102.0).contains(&thin), "{tiny} {thin}");
}

#[test]
fn tones_are_full_where_all_is_covered() {
    for power in [0.5, 0.8, 1.0] {
        let tone = Tone::new(power);
        assert_eq!((tone.of(1.0), tone.of(7.0)), (1.0, 1.0));
        assert!((tone.of(0.25) - 0.25_f32.powf(power as f32)).abs() < 1e-3);
    }
}

#[test]
fn colors_tell_what_they_are_asked_for() {
    let world = setting(&[Shape::rectangle(20.0, 20.0)], &[]);
    let mut bodies: Vec<Row> = [(250.0, 50.0), (350.0, 50.0), (250.0, 350.0)].map(|(x, y)| row(0, x, y, 0.0)).to_vec();
    bodies[0].vx = 10.0;
    bodies[1].omega = -2.0;
    let mut frame = frame(bodies);
    frame.ranks = vec![(0, 1), (3, 3)];
    let live = Live { contacts: vec![0, 2, 9], asleep: vec![true, false, false], ..Live::default() };
    frame.live = Some(live);
    let colors_of = |by| {
        let pixels = right_of_labels(&world, &frame, look(by));
        let at = |x: usize, y: usize| Rgb(pixels[(SIZE as usize - 1 - y) * (SIZE as usize - 150) + x - 150]);
        // Left of the mark.
        [at(245, 50), at(345, 50), at(245, 350)]
    };
    assert_eq!(colors_of(ColorBy::Kind), [colors::distinct(0); 3]);
    assert_eq!(colors_of(ColorBy::Rank), [0, 3, 3].map(colors::distinct));
    assert_eq!(colors_of(ColorBy::Tile), [colors::tile(2, 0), colors::tile(3, 0), colors::tile(2, 3)]);
    assert_eq!(colors_of(ColorBy::Contacts), [0, 2, 9].map(paint::contacts));
    assert_eq!(colors_of(ColorBy::Asleep), [colors::ASLEEP, colors::AWAKE, colors::AWAKE]);
    let [fast, slow, _] = colors_of(ColorBy::Speed);
    assert_eq!([fast, slow], [1.0, 0.0].map(|part| colors::Scale::Amount.at(part)));
    let [still, turning, _] = colors_of(ColorBy::Spin);
    assert_eq!(turning, colors::Scale::Ways.at(0.0));
    assert!(still != turning && still == Rgb(colors::Scale::Ways.table()[127].0));
}

#[test]
fn neighbours_have_other_colors() {
    for (column, row) in [(0, 0), (3, 4), (7, 2)] {
        for (dx, dy) in [(1, 0), (0, 1), (1, 1)] {
            assert_ne!(colors::tile(column, row), colors::tile(column + dx, row + dy));
            assert_ne!(colors::tile(column + 1, row), colors::tile(column, row + dy.max(1)));
        }
    }
    let mut all: Vec<[u8; 3]> = (0..30).map(|rank| colors::distinct(rank).0).collect();
    all.sort_unstable();
    all.dedup();
    assert_eq!(all.len(), 30);
}

#[test]
fn ranks_are_found_by_where_their_bodies_are() {
    let world = setting(&[Shape::circle(1.0)], &[]);
    // Of three bodies in one tile one has just come from a neighbour.
    let places = [(50.0, 50.0), (60.0, 50.0), (99.0, 50.0), (98.0, 50.0), (150.0, 50.0)];
    let mut frame = frame(places.map(|(x, y)| row(0, x, y, 0.0)).to_vec());
    frame.ranks = vec![(0, 3), (1, 5)];
    let mut ranks = Vec::new();
    tiles::ranks_of_tiles(&world, &frame, &mut ranks);
    assert_eq!((ranks[0], ranks[1], ranks[2]), (Some(0), Some(1), None));
    frame.live = Some(Live { rank_of_tile: vec![5; 16], ..Live::default() });
    tiles::ranks_of_tiles(&world, &frame, &mut ranks);
    assert_eq!(ranks, [Some(5); 16]);
}

#[test]
fn what_is_written_hides_no_body() {
    let world = setting(&[Shape::rectangle(20.0, 20.0)], &[]);
    for size in [[400, 400], [900, 400], [400, 900], [640, 360]] {
        let mut painter = Painter::new(&world, Look { size, bare: false, ..look(ColorBy::Rank) });
        let mut drawn = |x, y| {
            let image = painter.draw(&frame(vec![row(0, x, y, 0.0)]), &view());
            image.pixels.as_chunks::<3>().0.iter().filter(|pixel| **pixel == colors::distinct(0).0).count()
        };
        let middle = drawn(200.0, 200.0);
        for (x, y) in [(12.0, 388.0), (12.0, 12.0), (388.0, 12.0), (388.0, 388.0)] {
            assert!(drawn(x, y).abs_diff(middle) < middle / 5, "{size:?}: {} of {middle} at {x}, {y}", drawn(x, y));
        }
    }
}

#[test]
fn labels_have_room_of_their_own() {
    let kinds = vec![Shape::circle(1.0); 40];
    let world = setting(&kinds, &[]);
    let letters = Letters::new();
    for size in [[320, 180], [320, 320], [500, 900], [1920, 1080], [3840, 2160], [64, 64]] {
        for by in [ColorBy::Kind, ColorBy::Speed, ColorBy::Spin, ColorBy::Tile, ColorBy::Rank, ColorBy::Contacts] {
            let layers = Layers { tiles: true, ghosts: true, contacts: true };
            let legend = Legend::new(by, &layers, &world, 64, 50.0);
            let layout = Labels::new(&letters, legend, &frame(Vec::new()), 60.0).fit(size.map(f64::from));
            let ([legend, facts], what) = ([layout.legend, layout.facts], format!("{size:?} {by:?} {layout:?}"));
            assert!(legend[1][1] < facts[0][1], "{what}");
            for [low, high] in [legend, facts] {
                assert!(low[0] >= 0.0 && low[1] >= 0.0, "{what}");
                assert!(high[0] <= f64::from(size[0]) && high[1] <= f64::from(size[1]), "{what}");
            }
            assert!(size[0] < 320 || layout.size >= 9.0, "{what}");
        }
    }
}

#[test]
fn the_same_frame_is_the_same_picture() {
    let world = setting(&[Shape::circle(0.7), Shape::rectangle(30.0, 9.0)], &[]);
    let bodies = (0..300).map(|i| row(i % 2, f64::from(i * 37 % 400), f64::from(i * 91 % 400), i as f32)).collect();
    let mut frame = frame(bodies);
    let look = Look { layers: Layers { tiles: true, ..Layers::default() }, ..look(ColorBy::Tile) };
    let mut painter = Painter::new(&world, look);
    let first = painter.draw(&frame, &view()).clone();
    frame.bodies.truncate(10);
    frame.ranks = vec![(0, 10)];
    assert_ne!(painter.draw(&frame, &view()), &first);
    frame.bodies = (0..300).map(|i| row(i % 2, f64::from(i * 37 % 400), f64::from(i * 91 % 400), i as f32)).collect();
    frame.ranks = vec![(0, 300)];
    assert_eq!(painter.draw(&frame, &view()), &first);
    assert_eq!(Painter::new(&world, look).draw(&frame, &view()), &first);
}

/// As where other ranks have them: large ones that overlap, and small ones of which many are in a pixel.
#[test]
fn the_order_of_bodies_shows_nowhere() {
    let world = setting(&[Shape::rectangle(9.0, 30.0), Shape::circle(0.7), Shape::circle(0.01)], &[]);
    let place = |id: u64, by: u64| (id * by % 5003) as f64 * 0.01 + 200.0;
    let body =
        |id: u64| Row { id, vx: (id % 41) as f32, ..row(id as u32 % 3, place(id, 37), place(id, 91), id as f32) };
    for color in [ColorBy::Kind, ColorBy::Speed] {
        let [one, other] = [1, 7919].map(|stride| {
            let bodies = frame((0..5000).map(|i| body(i * stride % 5000)).collect());
            Painter::new(&world, look(color)).draw(&bodies, &view()).clone()
        });
        assert!(one == other, "{color:?}");
    }
}

#[test]
fn a_view_keeps_its_proportions() {
    let fit =
        Fit::within(&View { low: DVec2::new(2.0, 1.0), high: DVec2::new(4.0, 2.0) }, [[0.0; 2], [100.0; 2]], 100.0);
    assert_eq!(fit.scale, 50.0);
    assert_eq!((fit.place(DVec2::new(2.0, 1.0)), fit.place(DVec2::new(4.0, 2.0))), ([0.0, 75.0], [100.0, 25.0]));
    // Walls that rise high are cut.
    let wall = (Shape::rectangle(10.0, 4000.0), 0.0, DVec2::new(-5.0, 2000.0));
    let whole = whole_view(&setting(&[], &[wall]));
    assert_eq!((whole.low, whole.high), (DVec2::new(-14.0, -4.0), DVec2::new(404.0, 416.0)));
}

#[test]
fn numbers_are_rounded_for_people() {
    assert_eq!(
        [0.3, 1.0, 1.1, 27.0, 0.002, 500.0].map(|value| length(round_up(value))),
        ["0.5 m", "1 m", "2 m", "50 m", "2 mm", "500 m"]
    );
    assert_eq!((length(2000.0), grouped(700_000), grouped(12)), ("2 km".into(), "700,000".into(), "12".into()));
    for (scale, expected) in [(1.0, 100.0), (0.9, 200.0), (1000.0, 0.1), (3.3e-4, 500_000.0)] {
        let (meters, pixels) = scale_bar(scale, 199.9);
        assert!((meters / expected - 1.0).abs() < 1e-9 && pixels <= 199.9 && pixels > 79.0, "{meters} {pixels}");
    }
}
