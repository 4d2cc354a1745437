//! Measures the size and speed of each format: `cargo bench --bench encoding -- MISSION.json [FOLDER]
//! [OUTPUT…]`.
//!
//! Draws the mission (in JSON) at 1280×720 once for each format and reports bytes, milliseconds per frame
//! above drawing, and for GIF the worst PSNR of a frame. With outputs, writes those into the folder in one
//! run.
#![allow(
    clippy::unwrap_used,
    clippy::expect_used,
    clippy::panic,
    clippy::print_stdout,
    missing_docs,
    reason = "a benchmark for people"
)]

use std::fs;
use std::ops::ControlFlow;
use std::path::{Path, PathBuf};
use std::time::Instant;

use bagreel::internals::draw::paint::raster::Painter;
use bagreel::internals::draw::picture;
use bagreel::internals::draw::strip::{StripSource, StripWidth, strip};
use bagreel::internals::draw::style::Style;
use bagreel::internals::draw::text::Fonts;
use bagreel::internals::export::Output;
use bagreel::internals::export::run;
use bagreel::internals::export::sequence::Sequence;
use bagreel::internals::export::sequence::{Choice, SequenceOptions};
use bagreel::internals::view::{ViewOptions, view};
use bagreel::internals::{layout, mission};

fn main() {
    let mut words = std::env::args().skip(1).filter(|a| a != "--bench");
    let Some(mission) = words.next() else {
        println!("usage: cargo bench --bench encoding -- MISSION.json [FOLDER] [OUTPUT…]");
        return;
    };
    let folder: PathBuf = words
        .next()
        .unwrap_or_else(|| "out/bench".to_owned())
        .into();
    let outputs: Vec<String> = words.collect();
    let path = Path::new(&mission);
    let mission = mission::read_json(&fs::read_to_string(path).unwrap(), path).unwrap();
    let (view, _) = view(&mission, &ViewOptions::default());
    let (style, fonts) = (Style::builtin("light").unwrap(), Fonts::bundled());
    let title = path.file_name().unwrap().to_string_lossy().into_owned();
    let options = picture::PageOptions {
        title: Some(title),
        ..picture::PageOptions::default()
    };
    let measured = picture::Measured::new(&view, &style, &fonts, options);
    let engine = layout::engine("layered").unwrap();
    let layout = layout::lay_out(measured.plan(), &measured.layout_options(), engine);
    let picture = measured.with(layout);
    let painter = Painter::new(&fonts);
    let variable = |name: &str| std::env::var(name).ok();
    let number = |name: &str| variable(name).and_then(|v| v.parse::<u32>().ok());
    let choice = variable("STRIP").map(|s| Choice::parse(&s).unwrap());
    let mm = number("MM").map(f64::from);
    let source = StripSource {
        mission: &mission,
        view: &view,
        picture: &picture,
        style: &style,
        fonts: &fonts,
        others: &[],
    };
    let width = mm.map_or(StripWidth::AtLeast(1280.0), StripWidth::Paper);
    let page = strip(source, &choice.clone().unwrap_or(Choice::Changes), width).unwrap();
    println!("strip: {:?}", page.remarks);
    let options = SequenceOptions {
        max_bytes: number("MOST").map(u64::from),
        strip: choice,
        ..SequenceOptions::default()
    };
    let sequence = Sequence {
        mission: &mission,
        data: &mission,
        places: None,
        notices: &mission.notices,
        view: &view,
        picture: &picture,
        unfolded: None,
        paired: None,
        painter: &painter,
        fonts: &fonts,
        latex: None,
        strip: Some(&page.scene),
        options,
    };
    let frame_times = sequence.frame_times(true).len();
    let run = |names: &[&str]| {
        let output = |n: &&str| Output::parse(&folder.join(n).to_string_lossy(), None).unwrap();
        let outputs: Vec<Output> = names.iter().map(output).collect();
        let begin = Instant::now();
        let go_on = &mut |_, _| ControlFlow::Continue(());
        let written = run::run(&sequence, &outputs, go_on).unwrap();
        (written, begin.elapsed().as_secs_f64() * 1e3)
    };
    if !outputs.is_empty() {
        let names: Vec<&str> = outputs.iter().map(String::as_str).collect();
        let (written, ms) = run(&names);
        println!("{written:#?}\n{ms:.0} ms");
        return;
    }
    run(&["warm.svg/{n}.svg"]);
    for name in [
        "a.gif",
        "png/{n}.png",
        "webp/{n}.webp",
        "svg/{n}.svg",
        "a.pdf",
        "a.json",
        "a.csv",
    ] {
        let (written, ms) = run(&[name]);
        let (bytes, each) = (written[0].bytes, ms / frame_times as f64);
        println!(
            "{name:14} {bytes:>9} bytes in {} files, {each:6.1} ms a frame with drawing",
            written[0].files
        );
    }
    println!(
        "a.gif: worst frame {:.1} dB",
        worst_psnr(&sequence, &folder.join("a.gif"))
    );
}

/// The lowest PSNR of a frame of the GIF compared with the drawn frame, in dB.
fn worst_psnr(sequence: &Sequence<'_>, path: &Path) -> f64 {
    let mut decoder = gif::DecodeOptions::new();
    decoder.set_color_output(gif::ColorOutput::RGBA);
    let mut decoder = decoder.read_info(fs::File::open(path).unwrap()).unwrap();
    let width = usize::from(decoder.width());
    let mut canvas = vec![0; width * usize::from(decoder.height()) * 4];
    let mut worst = f64::INFINITY;
    for frame_time in sequence.frame_times(true) {
        let Some(frame) = decoder.read_next_frame().unwrap() else {
            break;
        };
        for (i, pixel) in frame
            .buffer
            .chunks_exact(4)
            .enumerate()
            .filter(|(_, p)| p[3] > 0)
        {
            let columns = usize::from(frame.width);
            let (x, y) = (
                i % columns + usize::from(frame.left),
                i / columns + usize::from(frame.top),
            );
            canvas[(y * width + x) * 4..][..4].copy_from_slice(pixel);
        }
        let pixels = sequence
            .painter
            .paint(&sequence.picture.scene(frame_time.window), 1.0)
            .unwrap();
        let square = |(a, b): (&u8, &u8)| f64::from(a.abs_diff(*b)).powi(2);
        let sum: f64 = canvas.iter().zip(&pixels.rgba).map(square).sum();
        let channels = (canvas.len() / 4 * 3) as f64;
        worst = worst.min(10.0 * (65_025.0 * channels / sum.max(1e-9)).log10());
    }
    worst
}
