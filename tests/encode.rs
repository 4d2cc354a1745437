//! Compares all formats of one run with each other, decoded by independent libraries: every frame, every pixel.

use std::fs;
use std::ops::ControlFlow;
use std::path::{Path, PathBuf};
use std::process::Command;

use bagreel::internals::base::error::{Error, Result};
use bagreel::internals::base::geometry::{Rect, Size};
use bagreel::internals::base::time::{Span, Stamp};
use bagreel::internals::draw::paint::raster::Painter;
use bagreel::internals::draw::scene::{Form, Group, Scene, Shape};
use bagreel::internals::draw::style::{Color, Style};
use bagreel::internals::draw::text::Fonts;
use bagreel::internals::export::run;
use bagreel::internals::export::sequence::{Drawings, Sequence, SequenceOptions};
use bagreel::internals::export::{Output, Written};
use bagreel::internals::mission::event_log::Kind;
use bagreel::internals::mission::{Mission, read_json};
use bagreel::internals::view::{Frame, Headline, View};
use bagreel::values::{Element, EventId, NodeId};

/// A disc that moves through every window, over discs in all colours.
struct Discs;

impl Drawings for Discs {
    fn scene(&self, window: usize) -> Scene {
        let style = Style::builtin("light").unwrap();
        let shade = |at: usize| u8::try_from(at * 40 % 256).unwrap();
        let colors: [Color; 20] =
            std::array::from_fn(|at| Color::of([shade(at), shade(at / 6), 90]));
        let mut group = Group::named("discs");
        for (i, color) in colors.iter().enumerate() {
            let place = Rect::new(12.0 * i as f64, 30.0, 40.0, 30.5);
            group.shape(Shape::filled(Form::Ellipse(place), *color));
        }
        let x = 20.0 * (window as f64 + 1.0);
        let color = colors[window % colors.len()];
        group.shape(Shape::filled(
            Form::Ellipse(Rect::new(x, 5.0, 22.0, 17.0)),
            color,
        ));
        Scene {
            size: Size::new(240.0, 100.0),
            width_mm: None,
            background: style.background(),
            title: String::new(),
            groups: vec![group],
        }
    }
}

/// Windows of which the odd ones show a change.
fn mission(windows: usize) -> (Mission, View) {
    let second = |i: usize| Stamp(i64::try_from(i).unwrap() * 1_000_000_000);
    let window = |i: usize| {
        let (start, end) = (second(i).0, second(i + 1).0);
        format!(r#"{{"start_ns": {start}, "end_ns": {end}}}"#)
    };
    let spans: Vec<String> = (0..windows).map(window).collect();
    let text = format!(
        r#"{{"schema": "bagreel.mission/3", "windows": [{}]}}"#,
        spans.join(", ")
    );
    let mission = read_json(&text, "mission.json".as_ref()).unwrap();
    let frame = |index: usize| Frame {
        headlines: (index % 2 == 1)
            .then_some(Headline {
                event: EventId(0),
                kind: Kind::Started,
                what: Element::Node(NodeId(0)),
                leaves: false,
                time: second(index),
            })
            .into_iter()
            .collect(),
        ..Frame::empty(
            index,
            Span {
                start: second(index),
                end: second(index + 1),
            },
        )
    };
    let frames = (0..windows).map(frame).collect();
    (
        mission,
        View {
            frames,
            ..View::default()
        },
    )
}

/// Writes a mission of eight windows to these outputs, all in `folder`.
fn show(folder: &Path, names: &[&str], options: SequenceOptions) -> Result<Vec<Written>> {
    let output = |name: &&str| Output::parse(&folder.join(name).to_string_lossy(), None);
    shown(
        &names.iter().map(output).collect::<Result<Vec<_>>>()?,
        options,
    )
}

fn shown(outputs: &[Output], options: SequenceOptions) -> Result<Vec<Written>> {
    run(outputs, options, &mut |_, _| ControlFlow::Continue(()))
}

fn run(
    outputs: &[Output],
    options: SequenceOptions,
    progress: &mut run::Progress<'_>,
) -> Result<Vec<Written>> {
    let (mission, view) = mission(8);
    let fonts = Fonts::bundled();
    let sequence = Sequence {
        mission: &mission,
        data: &mission,
        places: None,
        notices: &mission.notices,
        view: &view,
        picture: &Discs,
        unfolded: None,
        paired: None,
        painter: &Painter::new(&fonts),
        fonts: &fonts,
        latex: None,
        strip: None,
        options,
    };
    run::run(&sequence, outputs, progress)
}

fn png(path: &Path) -> image::RgbImage {
    image::open(path).unwrap().to_rgb8()
}

/// The frames of a GIF as a viewer composes them, with their delays in milliseconds.
fn gif_frames(path: &Path) -> Vec<(u32, image::RgbImage)> {
    let mut decoder = gif::DecodeOptions::new();
    decoder.set_color_output(gif::ColorOutput::RGBA);
    let mut decoder = decoder.read_info(fs::File::open(path).unwrap()).unwrap();
    let (width, height) = (u32::from(decoder.width()), u32::from(decoder.height()));
    let mut canvas = image::RgbImage::new(width, height);
    let mut frames = Vec::new();
    while let Some(frame) = decoder.read_next_frame().unwrap() {
        let (left, top) = (u32::from(frame.left), u32::from(frame.top));
        for (i, pixel) in (0_u32..).zip(frame.buffer.chunks_exact(4)) {
            if pixel[3] > 0 {
                let (x, y) = (i % u32::from(frame.width), i / u32::from(frame.width));
                canvas.put_pixel(
                    left + x,
                    top + y,
                    image::Rgb([pixel[0], pixel[1], pixel[2]]),
                );
            }
        }
        frames.push((u32::from(frame.delay) * 10, canvas.clone()));
    }
    frames
}

/// Peak signal to noise ratio in dB, over all channels.
fn psnr(a: &image::RgbImage, b: &image::RgbImage) -> f64 {
    assert_eq!(a.dimensions(), b.dimensions());
    let square = |(a, b): (&u8, &u8)| f64::from(a.abs_diff(*b)).powi(2);
    let sum: f64 = a.as_raw().iter().zip(b.as_raw()).map(square).sum();
    10.0 * (255.0_f64.powi(2) * a.as_raw().len() as f64 / sum).log10()
}

/// The names in a folder, sorted.
fn names(folder: &Path) -> Vec<String> {
    let name = |e: std::io::Result<fs::DirEntry>| e.unwrap().file_name().into_string().unwrap();
    let mut names: Vec<String> = fs::read_dir(folder).unwrap().map(name).collect();
    names.sort();
    names
}

#[test]
fn every_animation_has_the_frames_of_the_images() {
    let folder = tempfile::tempdir().unwrap();
    let outputs = ["a.gif", "p{n}.png", "w{n}.webp", "s/{n}.svg"];
    let options = SequenceOptions {
        frame_ms: Some(1000),
        ..SequenceOptions::default()
    };
    let written = show(folder.path(), &outputs, options).unwrap();
    assert_eq!(
        written.iter().map(|w| w.files).collect::<Vec<_>>(),
        [1, 8, 8, 8]
    );
    let gif = gif_frames(&folder.path().join("a.gif"));
    assert_eq!(gif.len(), 8);
    for (k, frame) in gif.iter().enumerate() {
        let still = png(&folder.path().join(format!("p{k}.png")));
        assert_eq!(still, png(&folder.path().join(format!("w{k}.webp"))));
        assert!(psnr(&still, &frame.1) > 50.0);
        assert_eq!(frame.0, 1000);
    }
    let drawings = names(&folder.path().join("s"));
    assert_eq!(
        drawings,
        (0..8).map(|k| format!("{k}.svg")).collect::<Vec<_>>()
    );
}

#[test]
fn output_is_deterministic() {
    let folders = [tempfile::tempdir().unwrap(), tempfile::tempdir().unwrap()];
    let outputs = [
        "a.gif",
        "p{n}.png",
        "w{n}.webp",
        "s{n}.svg",
        "d.json",
        "t.csv",
        "e.pdf",
    ];
    for folder in &folders {
        show(folder.path(), &outputs, SequenceOptions::default()).unwrap();
    }
    let files = names(folders[0].path());
    assert_eq!(files.len(), 2 + 3 * 8 + 1 + 7);
    assert_eq!(files, names(folders[1].path()));
    for file in files {
        let [a, b] = folders
            .each_ref()
            .map(|f| fs::read(f.path().join(&file)).unwrap());
        assert!(a == b, "{file} differs");
    }
}

#[test]
fn a_size_limit_is_met_and_reductions_are_reported() {
    let folder = tempfile::tempdir().unwrap();
    let bytes = show(folder.path(), &["a.gif"], SequenceOptions::default()).unwrap()[0].bytes;
    for part in [10, 9, 4] {
        let most = bytes * part / 10;
        let options = SequenceOptions {
            max_bytes: Some(most),
            ..SequenceOptions::default()
        };
        let written = show(folder.path(), &["a.gif", "d.json"], options).unwrap();
        assert!(written[0].bytes <= most);
        assert_eq!(
            fs::metadata(&written[0].path).unwrap().len(),
            written[0].bytes
        );
        assert_eq!(written[0].remarks.is_empty(), part == 10);
    }
    let options = SequenceOptions {
        max_bytes: Some(100),
        ..SequenceOptions::default()
    };
    let error = show(folder.path(), &["c.gif"], options).unwrap_err();
    assert!(error.to_string().contains("c.gif"), "{error}");
    assert!(!folder.path().join("c.gif").exists());
}

#[test]
fn an_interrupted_run_leaves_no_files() {
    let folder = tempfile::tempdir().unwrap();
    let output =
        |name: &str| Output::parse(&folder.path().join(name).to_string_lossy(), None).unwrap();
    let outputs = [output("a.gif"), output("b.pdf"), output("d.json")];
    let at_once = &mut |_: usize, _: usize| ControlFlow::Break(());
    let result = run(&outputs, SequenceOptions::default(), at_once);
    assert!(matches!(result, Err(Error::Interrupted)));
    assert_eq!(names(folder.path()), Vec::<String>::new());
}

#[test]
#[cfg(target_os = "linux")]
fn a_full_disk_ends_the_run_and_names_the_file() {
    let folder = tempfile::tempdir().unwrap();
    let link: PathBuf = folder.path().join("full.gif");
    std::os::unix::fs::symlink("/dev/full", &link).unwrap();
    let error = show(
        folder.path(),
        &["a.gif", "full.gif"],
        SequenceOptions::default(),
    )
    .unwrap_err();
    assert!(error.to_string().contains("full.gif"), "{error}");
    // The other one was complete before.
    assert_eq!(names(folder.path()), ["a.gif", "full.gif"]);
}

#[test]
fn formats_with_all_windows_refuse_a_window_number() {
    let folder = tempfile::tempdir().unwrap();
    for name in ["{n}.gif", "{n}.json", "{n}.csv"] {
        let result = show(folder.path(), &[name], SequenceOptions::default());
        assert!(result.is_err_and(|e| e.is_usage()), "{name}");
    }
}

/// Whether a third-party program is available for the check; prints a line if not.
fn has(program: &str) -> bool {
    let run = Command::new(program).arg("-version").output();
    let run = run.or_else(|_| Command::new(program).arg("-v").output());
    if run.is_err() {
        println!("skipped: `{program}` is not installed");
    }
    run.is_ok()
}

fn output_of(program: &str, arguments: &[&str]) -> String {
    let run = Command::new(program).args(arguments).output().unwrap();
    assert!(
        run.status.success(),
        "{}",
        String::from_utf8_lossy(&run.stderr)
    );
    String::from_utf8(run.stdout).unwrap()
}

#[test]
fn a_pdf_has_a_page_per_window_that_looks_like_the_image() {
    if !has("pdftoppm") {
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    show(
        folder.path(),
        &["a.pdf", "p{n}.png"],
        SequenceOptions::default(),
    )
    .unwrap();
    let at = |name: &str| folder.path().join(name).to_string_lossy().into_owned();
    output_of("pdftoppm", &["-r", "96", "-png", &at("a.pdf"), &at("page")]);
    for k in 0..8 {
        let page = png(Path::new(&at(&format!("page-{}.png", k + 1))));
        let still = png(Path::new(&at(&format!("p{k}.png"))));
        assert!(psnr(&still, &page) > 25.0, "page {k}");
    }
    assert!(!folder.path().join("page-9.png").exists());
}

#[test]
fn a_deleted_folder_is_reported_and_no_files_remain() {
    let folder = tempfile::tempdir().unwrap();
    let inside = folder.path().join("gone");
    let outputs = [Output::parse(&inside.join("a.gif").to_string_lossy(), None).unwrap()];
    let vanish = &mut |_: usize, _: usize| {
        let _ = fs::remove_dir_all(&inside);
        ControlFlow::Continue(())
    };
    let error = run(&outputs, SequenceOptions::default(), vanish).unwrap_err();
    assert!(error.to_string().contains("a.gif"), "{error}");
    assert_eq!(names(folder.path()), Vec::<String>::new());
}
