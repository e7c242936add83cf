//! Files of pictures, read back.

use super::video::Video;
use super::*;
use crate::error::Exit;
use std::fs;
use std::process::Command;
use tempfile::tempdir;

const SIZE: [u32; 2] = [61, 40];

/// A square that moves over a field of many colors.
fn picture(step: u64) -> Image {
    let color = |i: usize| {
        let (x, y) = (i % SIZE[0] as usize, i / SIZE[0] as usize);
        let is_square = x.abs_diff(3 + 4 * step as usize) < 3 && y.abs_diff(20) < 3;
        if is_square { [200, 30, 40] } else { [(4 * x) as u8, (6 * y) as u8, (3 * (x + y) % 256) as u8] }
    };
    let pixels = (0..SIZE[0] as usize * SIZE[1] as usize).flat_map(color).collect();
    Image { size: SIZE, step: 120 * step, pixels }
}

fn rate(rate: f64) -> Rate {
    Rate { added: rate, shown: rate }
}

fn write(path: &Path, steps: std::ops::Range<u64>) {
    let mut film = Film::create(path, SIZE, rate(30.0)).unwrap();
    steps.for_each(|step| film.add(&picture(step)).unwrap());
    assert!(!path.exists(), "nothing has its name before it is whole");
    film.finish().unwrap();
}

fn names(folder: &Path) -> Vec<String> {
    let mut names: Vec<String> =
        fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().file_name().into_string().unwrap()).collect();
    names.sort();
    names
}

fn read_png(path: &Path) -> Vec<u8> {
    let mut reader = ::png::Decoder::new(std::io::BufReader::new(fs::File::open(path).unwrap())).read_info().unwrap();
    let mut pixels = vec![0; reader.output_buffer_size().unwrap()];
    reader.next_frame(&mut pixels).unwrap();
    pixels
}

#[test]
fn a_png_is_the_picture() {
    let folder = tempdir().unwrap();
    let path = folder.path().join("one.PNG");
    write(&path, 0..3);
    assert_eq!(read_png(&path), picture(2).pixels);
    assert_eq!(names(folder.path()), ["one.PNG"]);
}

#[test]
fn a_folder_has_a_picture_for_each_step() {
    let folder = tempdir().unwrap();
    let path = folder.path().join("frames");
    write(&path, 0..2);
    assert_eq!(names(&path), ["frame-0000000000.png", "frame-0000000120.png"]);
    assert_eq!(read_png(&path.join("frame-0000000120.png")), picture(1).pixels);
    // What is there stays, and an empty folder is as good as none.
    let error = Film::create(&path, SIZE, rate(30.0)).unwrap_err();
    assert!(error.to_string().contains("it is a folder that is not empty"), "{error}");
    fs::create_dir(folder.path().join("empty")).unwrap();
    let film = Film::create(&folder.path().join("empty"), SIZE, rate(30.0)).unwrap();
    drop(film);
    assert_eq!(names(folder.path()), ["empty", "frames"]);
}

#[test]
fn a_gif_has_every_picture_in_its_time() {
    let folder = tempdir().unwrap();
    let path = folder.path().join("film.gif");
    let mut film = Film::create(&path, SIZE, rate(30.0)).unwrap();
    for step in [0, 1, 1, 2, 3, 4] {
        film.add(&picture(step)).unwrap();
    }
    film.finish().unwrap();
    let mut options = ::gif::DecodeOptions::new();
    options.set_color_output(::gif::ColorOutput::RGBA);
    let mut decoder = options.read_info(fs::File::open(&path).unwrap()).unwrap();
    let mut shown = picture(0).pixels;
    let (mut frames, mut delays) = (0, 0);
    let steps = [0, 1, 1, 2, 3, 4];
    while let Some(frame) = decoder.read_next_frame().unwrap() {
        for (i, pixel) in frame.buffer.as_chunks::<4>().0.iter().enumerate().filter(|(_, pixel)| pixel[3] > 0) {
            let (x, y) = (i % usize::from(frame.width), i / usize::from(frame.width));
            let at = 3 * ((y + usize::from(frame.top)) * SIZE[0] as usize + x + usize::from(frame.left));
            shown[at..at + 3].copy_from_slice(&pixel[..3]);
        }
        let wanted = picture(steps[frames]).pixels;
        let far = shown.iter().zip(&wanted).map(|(a, b)| a.abs_diff(*b)).max().unwrap();
        assert!(far <= 32, "picture {frames} is {far} off");
        frames += 1;
        delays += frame.delay;
    }
    assert_eq!((frames, delays), (6, 20));
}

#[test]
fn few_colors_stay_as_they_are() {
    let mut palette = palette::Palette::default();
    let colors: Vec<[u8; 3]> = (0..250_u8).map(|i| [i, 255 - i, i / 2]).filter(|color| color[0] % 8 == 0).collect();
    palette.choose([colors.as_flattened()].into_iter());
    let chosen = palette.colors();
    for color in colors {
        let at = 3 * usize::from(palette.index(color));
        assert_eq!(chosen[at..at + 3], color);
    }
}

#[test]
fn what_is_not_finished_leaves_nothing() {
    let folder = tempdir().unwrap();
    for name in ["a.png", "a.gif", "frames"] {
        let mut film = Film::create(&folder.path().join(name), SIZE, rate(10.0)).unwrap();
        film.add(&picture(0)).unwrap();
        drop(film);
        // Nor what has no picture.
        let error = Film::create(&folder.path().join(name), SIZE, rate(10.0)).unwrap().finish().unwrap_err();
        assert_eq!(error.exit(), Exit::Output);
    }
    assert_eq!(names(folder.path()), [""; 0]);
}

#[test]
fn bad_paths_are_told_at_once() {
    let folder = tempdir().unwrap();
    fs::create_dir(folder.path().join("taken.gif")).unwrap();
    for (name, expected) in [
        ("film.avi", "film.avi: nothing is known of .avi; end the name in .png"),
        ("taken.gif", "it is a directory"),
        ("no/film.gif", "No such file"),
        ("no/frames", "No such file"),
    ] {
        let error = Film::create(&folder.path().join(name), SIZE, rate(30.0)).unwrap_err();
        assert!(error.to_string().contains(expected) && error.exit() == Exit::Usage, "{error}");
        assert!(!error.to_string().contains('\n'));
    }
    assert_eq!(names(folder.path()), ["taken.gif"]);
}

#[test]
fn without_ffmpeg_one_line_says_what_to_do() {
    let folder = tempdir().unwrap();
    let path = folder.path().join("film.mp4");
    let error = Video::create_by("no-such-ffmpeg", &path, FilmKind::Mp4, SIZE, rate(30.0)).unwrap_err();
    assert!(error.to_string().contains("the program ffmpeg, which is not on the PATH"), "{error}");
    assert_eq!((error.exit(), names(folder.path()).len()), (Exit::Usage, 0));
}

/// A program in the place of ffmpeg that ends early is noticed, whether it says why or not.
#[cfg(unix)]
#[test]
fn a_program_that_fails_is_heard_and_never_waited_for() {
    use std::os::unix::fs::PermissionsExt;
    let folder = tempdir().unwrap();
    let program = folder.path().join("program");
    for (script, expected) in [
        ("#!/bin/sh\nhead -c 100 >&2\necho 'No space left on device' >&2\nexit 1\n", "No space left on device"),
        ("#!/bin/sh\nexec <&-\nyes complaint | head -c 1000000 >&2\nexit 3\n", "complaint"),
        ("#!/bin/sh\nexit 7\n", "it did not say why"),
    ] {
        fs::write(&program, script).unwrap();
        fs::set_permissions(&program, fs::Permissions::from_mode(0o755)).unwrap();
        let path = folder.path().join("film.mp4");
        let mut film = Video::create_by(program.to_str().unwrap(), &path, FilmKind::Mp4, SIZE, rate(30.0)).unwrap();
        let added = (0..60).try_for_each(|step| film.add(&picture(step % 10)));
        let error = added.and_then(|()| film.finish()).unwrap_err().to_string();
        assert!(error.starts_with("ffmpeg failed") && error.contains(expected), "{error}");
        assert_eq!(names(folder.path()), ["program"]);
    }
}

#[test]
fn films_by_ffmpeg_have_every_picture() {
    let folder = tempdir().unwrap();
    for name in ["film.mp4", "film.webm"] {
        let path = folder.path().join(name);
        if Command::new("ffmpeg").arg("-version").output().is_err() {
            println!("{name} is not tried: there is no ffmpeg");
            continue;
        }
        write(&path, 0..9);
        let begins = fs::read(&path).unwrap();
        // Odd sides are cut to even ones, and the same pictures are the same file.
        write(&folder.path().join("again").with_extension(&name[5..]), 0..9);
        assert!(begins == fs::read(folder.path().join("again").with_extension(&name[5..])).unwrap(), "{name}");
        let probe = Command::new("ffprobe")
            .args("-v error -count_frames -show_entries stream=nb_read_frames,width,height -of csv=p=0".split(' '))
            .arg(&path)
            .output();
        match probe {
            Ok(told) => assert_eq!(String::from_utf8_lossy(&told.stdout).trim(), "60,40,9", "{name}: {told:?}"),
            Err(_) => println!("the pictures of {name} are not counted: there is no ffprobe"),
        }
    }
}
