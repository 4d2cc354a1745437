//! Measures how fast frames are drawn: `cargo bench --bench drawing -- MISSION.json [FRAMES]`.
//!
//! Draws the mission (in JSON) at 1280×720 and prints a table: everything included on one core and on two,
//! drawing alone, drawing over the last frame where less than a tenth of the elements changed, and a long run with
//! its memory. The latest results are in `drawing.md`.
#![allow(
    clippy::unwrap_used,
    clippy::print_stdout,
    missing_docs,
    reason = "a benchmark for people"
)]

use std::path::Path;
use std::time::{Duration, Instant};

use bagreel::internals::draw::paint::raster::{Canvas, Painter, Pixels};
use bagreel::internals::draw::picture::{Measured, PageOptions, Picture};
use bagreel::internals::draw::scene::Scene;
use bagreel::internals::draw::style::Style;
use bagreel::internals::draw::text::Fonts;
use bagreel::internals::view::{View, ViewOptions, view};
use bagreel::internals::{layout, mission};
use image::codecs::png::{CompressionType, FilterType, PngEncoder};
use image::{ExtendedColorType, ImageEncoder as _};
use rayon::prelude::*;

fn main() {
    let mut words = std::env::args().skip(1).filter(|a| a != "--bench");
    let Some(mission) = words.next() else {
        println!("usage: cargo bench --bench drawing -- MISSION.json [FRAMES]");
        return;
    };
    let frames: usize = words.next().map_or(3600, |n| n.parse().unwrap());
    let path = Path::new(&mission);
    let mut mission = mission::read_json(&std::fs::read_to_string(path).unwrap(), path).unwrap();
    mission.find_changes(0.25);
    let (view, _) = view(&mission, &ViewOptions::default());
    let (style, fonts) = (Style::builtin("light").unwrap(), Fonts::bundled());
    let measured = Measured::new(&view, &style, &fonts, PageOptions::default());
    let engine = layout::engine("layered").unwrap();
    let layout = layout::lay_out(measured.plan(), &measured.layout_options(), engine);
    let picture = measured.with(layout);
    let painter = Painter::new(&fonts);
    println!(
        "{} boxes, {} arrows, {} windows",
        view.items.len(),
        view.arrows.len(),
        picture.len()
    );
    println!("| what | frames | ms/frame | frames/s |\n|---|---|---|---|");

    let cold = Painter::new(&fonts);
    row(
        "first frame, nothing known",
        1,
        timed(|| drop(cold.paint(&picture.scene(0), 1.0).unwrap())),
    );
    let all: Vec<usize> = (0..picture.len()).collect();
    row(
        "scenes alone",
        all.len(),
        timed(|| all.iter().for_each(|k| drop(picture.scene(*k)))),
    );
    row(
        "drawn anew",
        all.len(),
        timed(|| {
            for k in &all {
                painter.paint(&picture.scene(*k), 1.0).unwrap();
            }
        }),
    );
    let long: Vec<usize> = (0..240).map(|k| k % picture.len()).collect();
    let one = timed(|| run(&picture, &painter, &long, 1));
    row("everything with PNG, one core", long.len(), one);
    let two = timed(|| run(&picture, &painter, &long, 2));
    row("everything with PNG, two cores", long.len(), two);
    println!(
        "two cores are {:.2} times as fast",
        one.as_secs_f64() / two.as_secs_f64()
    );

    over_the_last(&picture, &painter, &view);
    let before = peak_mb();
    let many: Vec<usize> = (0..frames).map(|k| k % picture.len()).collect();
    row(
        "a long run, two cores",
        many.len(),
        timed(|| run(&picture, &painter, &many, 2)),
    );
    println!(
        "memory at its peak: {before} MB before the long run, {} MB after",
        peak_mb()
    );
}

/// Draws and encodes each frame as a PNG, in chunks as the program does; returns the bytes.
fn run(picture: &Picture<'_>, painter: &Painter, frames: &[usize], threads: usize) -> usize {
    let pool = rayon::ThreadPoolBuilder::new()
        .num_threads(threads)
        .build()
        .unwrap();
    let chunk = |chunk: &[usize]| -> usize {
        let mut canvas = Canvas::new(painter, 1.0);
        chunk
            .iter()
            .map(|k| png(canvas.draw(picture.scene(*k)).unwrap().pixels))
            .sum()
    };
    pool.install(|| frames.par_chunks(30).map(chunk).sum())
}

fn png(pixels: &Pixels) -> usize {
    let mut out = Vec::new();
    let rgb: Vec<u8> = pixels
        .rgba
        .chunks_exact(4)
        .flat_map(|p| [p[0], p[1], p[2]])
        .collect();
    PngEncoder::new_with_quality(&mut out, CompressionType::Fast, FilterType::Adaptive)
        .write_image(&rgb, pixels.width, pixels.height, ExtendedColorType::Rgb8)
        .unwrap();
    out.len()
}

/// Frames in which less than a tenth of the elements differ from the frame before.
fn over_the_last(picture: &Picture<'_>, painter: &Painter, view: &View) {
    let few = view.items.len() + view.arrows.len();
    let mut canvas = Canvas::new(painter, 1.0);
    let (mut time, mut drawing, mut count) = (Duration::ZERO, Duration::ZERO, 0);
    let mut last = picture.scene(0);
    canvas.draw(last.clone()).unwrap();
    for k in 1..picture.len() {
        let start = Instant::now();
        let scene = picture.scene(k);
        let between = Instant::now();
        let drawn = canvas.draw(scene.clone()).unwrap();
        let end = Instant::now();
        assert!(
            *drawn.pixels == painter.paint(&scene, 1.0).unwrap(),
            "window {k}"
        );
        if differing(&last, &scene) * 10 < few {
            time += end - start;
            drawing += end - between;
            count += 1;
        }
        last = scene;
    }
    row(
        "over the last frame, < 10 % changed, with the scene",
        count,
        time,
    );
    row(
        "over the last frame, < 10 % changed, pixels alone",
        count,
        drawing,
    );
}

fn differing(a: &Scene, b: &Scene) -> usize {
    let old: std::collections::BTreeMap<&str, _> =
        a.groups.iter().map(|g| (g.id.as_str(), g)).collect();
    let elements = b.groups.iter().filter(|g| !g.data.is_empty());
    elements
        .filter(|g| old.get(g.id.as_str()) != Some(g))
        .count()
}

fn timed<T>(work: impl FnOnce() -> T) -> Duration {
    let start = Instant::now();
    std::hint::black_box(work());
    start.elapsed()
}

fn row(what: &str, frames: usize, time: Duration) {
    let each = time.as_secs_f64() / frames.max(1) as f64;
    println!(
        "| {what} | {frames} | {:.2} | {:.0} |",
        each * 1000.0,
        1.0 / each
    );
}

/// The peak memory of this process; 0 if unknown.
fn peak_mb() -> u64 {
    let status = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    let line = status.lines().find(|l| l.starts_with("VmHWM"));
    let kb = line
        .and_then(|l| l.split_whitespace().nth(1))
        .and_then(|n| n.parse::<u64>().ok());
    kb.unwrap_or(0) / 1024
}
