//! Snapshot tests of pictures: the SVG text of every style, and the pixels of a few frames.
//!
//! `SNAPSHOTS=new cargo test --release --test tests pictures` accepts the current pictures; check them first. If
//! pixels differ, `target/pictures/` shows expected, difference and actual side by side.

use std::path::{Path, PathBuf};

use bagreel::internals::base::geometry::Size;
use bagreel::internals::draw::style::BUILTIN;
use bagreel::values::{Length, Period};
use bagreel::{Output, Reading, Render, Style, render};
use image::RgbaImage;

use crate::support::snapshot::{assert_snapshot, is_new};

/// Missions, with the period (a mission in JSON has its own) and the window with the most features.
const MISSIONS: &[(&str, &str, usize)] = &[
    ("examples/warehouse.bag", "10", 16),
    ("examples/courier.mcap", "10", 5),
    ("tests/data/marks.json", "", 2),
];

/// The tolerance per channel: pixels are only reproducible exactly on one kind of machine.
const TOLERANCE: u8 = 2;

fn root() -> &'static Path {
    Path::new(env!("CARGO_MANIFEST_DIR"))
}

/// Draws every window of a mission; returns the file of one of them.
fn drawn(
    folder: &Path,
    mission: (&str, &str, usize),
    style: &str,
    word: &str,
    size: Size,
) -> PathBuf {
    let (path, period, window) = mission;
    let mut reading = Reading::of([root().join(path)]);
    if !period.is_empty() {
        reading.division.length = Period::parse(period).map_or(Length::Auto, Length::Fixed);
    }
    let frames = folder.join(format!("{{n}}.{word}"));
    let mut job = Render::new(
        reading,
        vec![Output::parse(&frames.display().to_string(), None).unwrap()],
    )
    .unwrap();
    job.drawing.style = Style::builtin(style).unwrap();
    job.drawing.page.size = size;
    job.drawing.is_sized = true;
    render(&job).unwrap();
    let mut files: Vec<PathBuf> = std::fs::read_dir(folder)
        .unwrap()
        .map(|e| e.unwrap().path())
        .collect();
    files.sort();
    files.swap_remove(window)
}

/// A word for a mission in a file's name.
fn word(path: &str) -> &str {
    path.rsplit('/').next().unwrap().split('.').next().unwrap()
}

#[test]
fn pictures_of_every_style_match_their_snapshots() {
    for mission in MISSIONS {
        for (style, _) in BUILTIN {
            let folder = tempfile::tempdir().unwrap();
            let file = drawn(
                folder.path(),
                *mission,
                style,
                "svg",
                Size::new(1280.0, 720.0),
            );
            let svg = std::fs::read_to_string(file).unwrap();
            assert_snapshot(&format!("{}_{style}.svg", word(mission.0)), &svg);
        }
    }
}

#[test]
fn pixels_match_the_reference_pictures() {
    for mission in MISSIONS {
        for style in ["light", "dark"] {
            let folder = tempfile::tempdir().unwrap();
            let file = drawn(
                folder.path(),
                *mission,
                style,
                "png",
                Size::new(640.0, 360.0),
            );
            let actual = image::open(file).unwrap().into_rgba8();
            compare(&format!("{}_{style}", word(mission.0)), &actual);
        }
    }
}

/// Compares with the reference picture, or replaces it.
fn compare(name: &str, actual: &RgbaImage) {
    let reference = root().join(format!("tests/data/pictures/{name}.png"));
    if is_new() {
        actual.save(reference).unwrap();
        return;
    }
    let expected = image::open(&reference).unwrap().into_rgba8();
    assert_eq!(actual.dimensions(), expected.dimensions(), "{name}");
    let differs = |a: &image::Rgba<u8>, b: &image::Rgba<u8>| {
        a.0.iter().zip(b.0).any(|(a, b)| a.abs_diff(b) > TOLERANCE)
    };
    let pairs = expected.pixels().zip(actual.pixels());
    let many = pairs.filter(|(a, b)| differs(a, b)).count();
    if many > 0 {
        let shown = root().join(format!("target/pictures/{name}.png"));
        std::fs::create_dir_all(shown.parent().unwrap()).unwrap();
        panels(&expected, actual, differs).save(&shown).unwrap();
        panic!("{name}: {many} pixels differ, see {}", shown.display());
    }
}

/// Expected, difference in red, and actual, side by side.
fn panels(
    expected: &RgbaImage,
    actual: &RgbaImage,
    differs: impl Fn(&image::Rgba<u8>, &image::Rgba<u8>) -> bool,
) -> RgbaImage {
    let (width, height) = expected.dimensions();
    RgbaImage::from_fn(width * 3, height, |x, y| {
        let (a, b) = (
            expected.get_pixel(x % width, y),
            actual.get_pixel(x % width, y),
        );
        match x / width {
            0 => *a,
            2 => *b,
            _ if differs(a, b) => image::Rgba([220, 0, 0, 255]),
            _ => image::Rgba([255, 255, 255, 255]),
        }
    })
}
