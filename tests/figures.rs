//! Tests of figures for papers: exact size, legible text, no overlaps.

use std::path::{Path, PathBuf};
use std::process::Command;
use std::sync::OnceLock;

use serde_json::{Value, json};

use crate::support::{pdf::letters_pt, windows};

/// A figure as SVG text, or the command's error.
fn figure(bag: &Path, flags: &[&str]) -> Result<String, String> {
    let folder = tempfile::tempdir().unwrap();
    let svg = folder.path().join("figure.svg");
    let out = Command::new(env!("CARGO_BIN_EXE_bagreel"))
        .args(["figure", "--quiet"])
        .arg(bag)
        .args(flags)
        .arg("-o")
        .arg(&svg)
        .output()
        .unwrap();
    if out.status.success() {
        Ok(std::fs::read_to_string(svg).unwrap())
    } else {
        Err(String::from_utf8_lossy(&out.stderr).into_owned())
    }
}

fn example() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("examples/warehouse.bag")
}

/// The figures of the example, drawn once for all tests, as [`FIGURES`] lists them.
fn drawn() -> &'static [String] {
    static DRAWN: OnceLock<Vec<String>> = OnceLock::new();
    DRAWN.get_or_init(|| {
        let draw = |(kind, width, _): &(&str, &str, f64)| {
            figure(&example(), &["--kind", kind, "--width", width]).unwrap()
        };
        FIGURES.iter().map(draw).collect()
    })
}

/// The stated width and height of the page in millimetres.
fn size_mm(svg: &str) -> (f64, f64) {
    let of = |name: &str| {
        let from = svg.find(&format!(" {name}=\"")).unwrap() + name.len() + 3;
        svg[from..].split("mm\"").next().unwrap().parse().unwrap()
    };
    (of("width"), of("height"))
}

#[test]
fn lifetimes_are_labelled_with_events() {
    let svg = figure(&example(), &["--kind", "lives"]).unwrap();
    for expected in [
        "8 nodes throughout",
        "lidar_driver restarted, away for 6.8 s",
        "topic is taken over",
    ] {
        assert!(svg.contains(expected), "{expected}");
    }
}

/// Every figure of the example at both widths, and the height that it may have.
const FIGURES: [(&str, &str, f64); 6] = [
    ("lives", "88mm", 110.0),
    ("lives", "181mm", 94.0),
    ("graph", "88mm", 130.0),
    ("graph", "181mm", 150.0),
    ("steps", "88mm", 225.0),
    ("steps", "181mm", 225.0),
];

#[test]
fn every_figure_has_the_requested_width_and_a_limited_height() {
    for ((kind, width, most), svg) in FIGURES.iter().zip(drawn()) {
        let (w, h) = size_mm(svg);
        let asked: f64 = width.trim_end_matches("mm").parse().unwrap();
        assert!((w - asked).abs() < 0.1, "{kind} {width}: {w}");
        assert!(h > 40.0 && h <= *most, "{kind} {width}: {h} mm high");
    }
}

#[test]
fn steps_show_the_requested_phases_or_list_the_available() {
    let svg = figure(&example(), &["--kind", "steps", "--steps", "3"]).unwrap();
    assert!(svg.contains("2 → 3") && !svg.contains("3 → 4"));
    // The log has no hand-over here: the planner continued.
    assert!(!svg.contains("plan: planner → replanner"));
    assert!(svg.contains("5 smaller steps left out"));
    let last = figure(&example(), &["--kind", "steps", "--steps", "7"]).unwrap();
    assert!(last.contains("cmd_vel: controller → dock_controller"));
    let none = figure(&example(), &["--kind", "steps", "--steps", "8"]).unwrap_err();
    assert!(none.contains("2 to 7"), "{none}");
}

#[test]
fn a_file_names_or_replaces_phases() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("phases.txt");
    let flags = ["--kind", "lives", "--phases", file.to_str().unwrap()];
    std::fs::write(&file, "boot\nnavigation\n").unwrap();
    assert!(
        figure(&example(), &flags)
            .unwrap()
            .contains("navigation (+4)")
    );
    std::fs::write(&file, "0:00 early\n2:00 late\n").unwrap();
    let svg = figure(&example(), &flags).unwrap();
    assert!(svg.contains("late (+"), "two phases");
    std::fs::write(&file, "2:00 late\n1:00 early\n").unwrap();
    assert!(figure(&example(), &flags).unwrap_err().contains("line 2"));
    std::fs::write(&file, "a\n".repeat(8)).unwrap();
    assert!(
        figure(&example(), &flags)
            .unwrap_err()
            .contains("more names")
    );
    let svg = figure(&example(), &["--kind", "lives", "--phases", "none"]).unwrap();
    assert!(!svg.contains("(+4)"), "phases are named");
}

/// A rectangle around each text, in pixels: letters of the bundled font are at least so wide.
fn boxes(svg: &str) -> Vec<(f64, f64, f64, f64, String)> {
    let of = |tag: &str, name: &str| -> Option<f64> {
        let from = tag.find(&format!(" {name}=\""))? + name.len() + 3;
        tag[from..].split('"').next()?.parse().ok()
    };
    let mut all = Vec::new();
    for tag in svg.split("<text").skip(1) {
        let (head, rest) = tag.split_once('>').unwrap();
        let words = rest.split("</text>").next().unwrap().to_owned();
        let (Some(x), Some(y), Some(size)) = (of(head, "x"), of(head, "y"), of(head, "font-size"))
        else {
            panic!("a text without a place: {head}");
        };
        let narrow = |c: char| "iljtfr.,:1I|/ ()'".contains(c);
        let wide: f64 = words
            .chars()
            .map(|c| if narrow(c) { 0.25 } else { 0.48 })
            .sum::<f64>()
            * size;
        let left = match () {
            () if head.contains("text-anchor=\"middle\"") => x - wide / 2.0,
            () if head.contains("text-anchor=\"end\"") => x - wide,
            () => x,
        };
        all.push((left, y - 0.6 * size, left + wide, y, words));
    }
    all
}

#[test]
fn texts_do_not_overlap() {
    for ((kind, width, _), svg) in FIGURES.iter().zip(drawn()) {
        let all = boxes(svg);
        for (k, a) in all.iter().enumerate() {
            for b in &all[k + 1..] {
                let apart = a.2 <= b.0 || b.2 <= a.0 || a.3 <= b.1 || b.3 <= a.1;
                assert!(apart, "{kind} {width}: `{}` and `{}`", a.4, b.4);
            }
        }
    }
}

#[test]
fn texts_do_not_cover_arrowheads() {
    for ((kind, width, _), svg) in FIGURES.iter().zip(drawn()).skip(2) {
        let texts = boxes(svg);
        let mut heads = 0;
        for points in svg.split("<polygon points=\"").skip(1) {
            let points = points.split('"').next().unwrap().split([' ', ',']);
            let points: Vec<f64> = points.map(|n| n.parse().unwrap()).collect();
            let [tip, y, ax, ay, bx, by] = points[..] else {
                continue;
            };
            let (x, y) = ((tip + ax + bx) / 3.0, (y + ay + by) / 3.0);
            let covers =
                |t: &&(f64, f64, f64, f64, String)| t.0 < x && x < t.2 && t.1 < y && y < t.3;
            let text = texts.iter().find(covers);
            assert!(text.is_none(), "{kind} {width}: {text:?} at {x}, {y}");
            heads += 1;
        }
        assert!(heads > 5, "{kind} {width}: {heads} arrowheads");
    }
}

#[test]
fn a_latex_figure_has_a_caption_and_compiles() {
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name);
    let out = Command::new(env!("CARGO_BIN_EXE_bagreel"))
        .args(["figure", "--quiet", "--kind", "lives", "--bare"])
        .arg(example())
        .arg("-o")
        .arg(at("lives.pdf"))
        .arg("-o")
        .arg(at("lives.tex"))
        .output()
        .unwrap();
    assert!(out.status.success(), "{out:?}");
    let tex = std::fs::read_to_string(at("lives.tex")).unwrap();
    for expected in [
        "\\includegraphics{lives.pdf}",
        "warehouse.bag",
        "2 (+4) from 0:38",
        "cross: end",
    ] {
        assert!(tex.contains(expected), "{expected}: {tex}");
    }
    let page = "\\documentclass{article}\\usepackage{graphicx}\\begin{document}\\input{lives}\\end{document}";
    std::fs::write(at("page.tex"), page).unwrap();
    let latex = Command::new("pdflatex")
        .args(["-interaction=nonstopmode", "-halt-on-error", "page.tex"])
        .current_dir(folder.path())
        .output();
    match latex {
        Ok(done) => assert!(
            done.status.success(),
            "{}",
            String::from_utf8_lossy(&done.stdout)
        ),
        Err(_) => println!("skipped: `pdflatex` is not installed"),
    }
}

/// The example paper: its script writes the digest, the tables and the figures, and typesets the page.
#[cfg(target_os = "linux")]
#[test]
fn the_example_paper_is_built_by_its_script() {
    let folder = tempfile::tempdir().unwrap();
    let examples = Path::new(env!("CARGO_MANIFEST_DIR")).join("examples");
    let paper = folder.path().join("paper");
    std::fs::create_dir(&paper).unwrap();
    std::fs::copy(example(), folder.path().join("warehouse.bag")).unwrap();
    for name in ["make.sh", "paper.tex", "phases.txt"] {
        std::fs::copy(examples.join("paper").join(name), paper.join(name)).unwrap();
    }
    let run = |command: &mut Command| {
        let done = command.current_dir(&paper).output().unwrap();
        let said = [done.stdout, done.stderr].concat();
        let said = String::from_utf8_lossy(&said).into_owned();
        assert!(done.status.success(), "{said}");
        said
    };
    run(Command::new("sh")
        .arg("make.sh")
        .env("BAGREEL", env!("CARGO_BIN_EXE_bagreel")));
    let said = run(Command::new("sha256sum").args(["-c", "SHA256SUMS"]));
    assert_eq!(said, "../warehouse.bag: OK\n");
    let read = |name: &str| std::fs::read_to_string(paper.join(name)).unwrap();
    assert!(read("VERSION").starts_with("bagreel "));
    assert!(read("survey.csv").lines().count() == 2 && read("events.csv").contains(",restarted,"));
    for name in ["lives", "graph", "steps"] {
        let pdf = std::fs::read(paper.join(format!("{name}.pdf"))).unwrap();
        assert!(pdf.starts_with(b"%PDF-"), "{name}");
        assert!(read(&format!("{name}.tex")).contains(&format!("{name}.pdf")));
    }
    if !paper.join("paper.pdf").exists() {
        return println!("skipped: `pdflatex` is not installed");
    }
    let log =
        String::from_utf8_lossy(&std::fs::read(paper.join("paper.log")).unwrap()).into_owned();
    for fault in ["Overfull \\hbox", "undefined", "too large for page"] {
        assert!(!log.contains(fault), "{fault}: {log}");
    }
    for name in ["lives", "graph", "steps"] {
        assert!(log.contains(&format!("<{name}.pdf")), "{name}: {log}");
    }
    assert!(log.contains("(1 page, "), "{log}");
}

/// Font sizes in points.
fn sizes_pt(svg: &str) -> Vec<f64> {
    let all = svg.split("font-size=\"").skip(1);
    let px = all.map(|rest| rest.split('"').next().unwrap().parse::<f64>().unwrap());
    px.map(|px| px * 0.75).collect()
}

#[test]
fn no_text_is_below_six_points() {
    for ((kind, width, _), svg) in FIGURES.iter().zip(drawn()) {
        let smallest = sizes_pt(svg).into_iter().fold(f64::MAX, f64::min);
        assert!(
            (5.95..=7.0).contains(&smallest),
            "{kind} {width}: {smallest}"
        );
    }
    let svg = figure(&example(), &["--kind", "lives", "--text", "8pt"]).unwrap();
    let smallest = sizes_pt(&svg).into_iter().fold(f64::MAX, f64::min);
    assert!(smallest >= 6.95, "{smallest}");
}

#[test]
fn no_letter_in_a_pdf_is_below_six_points() {
    let folder = tempfile::tempdir().unwrap();
    let pdf = folder.path().join("figure.pdf");
    for (kind, width, _) in FIGURES {
        let out = Command::new(env!("CARGO_BIN_EXE_bagreel"))
            .args(["figure", "--quiet", "--kind", kind, "--width", width])
            .arg(example())
            .arg("-o")
            .arg(&pdf)
            .output()
            .unwrap();
        assert!(out.status.success(), "{out:?}");
        let letters = letters_pt(&std::fs::read(&pdf).unwrap());
        let smallest = letters.iter().copied().fold(f64::MAX, f64::min);
        let largest = letters.iter().copied().fold(0.0, f64::max);
        assert!(letters.len() > 40, "{kind} {width}: {}", letters.len());
        assert!(smallest >= 5.999, "{kind} {width}: {smallest} pt");
        assert!(largest < 7.001, "{kind} {width}: {largest} pt");
    }
}

/// A mission of many nodes in nested namespaces, two of which start and one of which stops halfway.
fn large(name: impl Fn(usize) -> String) -> Value {
    let start = 1_700_000_000_000_000_000_i64;
    let second = 1_000_000_000_i64;
    let there = |w: i64, k: usize| match k {
        7 | 20 => w >= 6,
        33 => w < 6,
        _ => true,
    };
    let window = |w: i64| {
        let who: Vec<usize> = (0..300).filter(|k| there(w, *k)).collect();
        let topic = |k: usize| format!("{}/out", name(k));
        let edge = |node: usize, of: usize| json!({"node": name(node), "topic": topic(of), "state": "active", "hz": 10.0, "count": 100});
        let heard = who.iter().filter(|k| **k >= 6).map(|k| edge(*k, k % 6));
        json!({
            "start_ns": start + w * 10 * second, "end_ns": start + (w + 1) * 10 * second, "messages": 1000,
            "nodes": who.iter().map(|k| json!({"name": name(*k), "state": "active"})).collect::<Vec<_>>(),
            "topics": who.iter().map(|k| json!({"name": topic(*k), "types": ["a/B"], "state": "active", "hz": 10.0, "count": 100}))
                .collect::<Vec<_>>(),
            "publishes": who.iter().map(|k| edge(*k, *k)).collect::<Vec<_>>(),
            "subscribes": heard.collect::<Vec<_>>(),
        })
    };
    let mut mission = windows::mission((0..12).map(window).collect());
    mission["bags"] = json!([{"name": "large", "format": "mcap"}]);
    mission
}

#[test]
fn too_many_nodes_are_grouped_by_shorter_namespaces() {
    let folder = tempfile::tempdir().unwrap();
    let mission = folder.path().join("large.json");
    let spaces = [
        "plan",
        "sense/near",
        "sense/far",
        "drive/left",
        "drive/right",
        "map",
    ];
    let named = |k: usize| format!("/{}/part{}/node{k}", spaces[k % 6], k / 6 % 5);
    std::fs::write(&mission, large(named).to_string()).unwrap();
    for kind in ["lives", "graph", "steps"] {
        let svg = figure(&mission, &["--kind", kind, "--width", "181mm"]).unwrap();
        let (w, h) = size_mm(&svg);
        assert!((w - 181.0).abs() < 0.1 && h <= 225.0, "{kind}: {w} x {h}");
        let together = ["more</text>", " +", " throughout</text>"];
        assert!(
            together.iter().any(|words| svg.contains(words)),
            "{kind} draws no two as one"
        );
        // Nodes that start or stop are not in a constant group.
        assert!(svg.contains("node33"), "{kind} hides who goes");
    }
    // Without namespaces, those that last are named in part.
    let kinds = ["camera_driver", "debug_info_monitor", "tracker"];
    let flat = |k: usize| format!("/{}_{k}", kinds[k % 3]);
    std::fs::write(&mission, large(flat).to_string()).unwrap();
    let svg = figure(&mission, &["--kind", "lives"]).unwrap();
    assert!(
        svg.contains("camera_driver_261 and 237 more."),
        "of 300 nodes"
    );
}

#[test]
fn a_figure_that_does_not_fit_is_refused_with_an_alternative() {
    let narrow = figure(&example(), &["--kind", "lives", "--width", "21mm"]).unwrap_err();
    let enough = narrow
        .split("--width ")
        .nth(1)
        .unwrap()
        .split('`')
        .next()
        .unwrap();
    assert!(
        figure(&example(), &["--kind", "lives", "--width", enough]).is_ok(),
        "{narrow}"
    );
    let nothing = figure(&example(), &["--kind", "lives", "--ns-filter", "/nobody"]);
    let said = nothing.err().unwrap_or_default();
    assert!(
        said.contains("`--ns-filter` matches none of 36 names"),
        "{said}"
    );
}

#[test]
fn options_without_effect_on_a_figure_are_refused() {
    for flags in [
        &["--kind", "lives", "--strip", "3x2"][..],
        &["--kind", "lives", "--style", "dark"],
        &["--kind", "lives", "--steps", "3"],
        &["--kind", "graph", "--rows", "topics"],
        &["--kind", "lives", "--text", "5pt"],
    ] {
        assert!(figure(&example(), flags).is_err(), "{flags:?}");
    }
}

#[test]
fn every_figure_that_info_lists_is_drawn() {
    let project = Path::new(env!("CARGO_MANIFEST_DIR"));
    let mut short = crate::support::Recording::default();
    for (node, topic, from) in [("/talker", "/chat", 0), ("/late", "/more", 3400)] {
        let place = short.publisher(node, topic, "std_msgs/String");
        short.send(place, (from, 30_000), 100, b"\x05\0\0\0hello");
    }
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("short.bag");
    let pack = crate::support::rosbag1::Pack::None;
    std::fs::write(&path, crate::support::rosbag1::write(&short, pack, 20_000)).unwrap();
    let shared = project.join("../shared/data");
    let bags = [
        path,
        example(),
        project.join("examples/courier.mcap"),
        shared.join("mini/mini_late.bag"),
        shared.join("mini/nodelet.bag"),
        shared.join("bags/paper/turtlesim.bag"),
        shared.join("bags/paper/mcap1"),
        shared.join("bags/mission/split_lz4_3.bag"),
    ];
    for bag in bags.iter().filter(|bag| bag.exists()) {
        let mission = bagreel::read(&bagreel::Reading::of([bag])).unwrap();
        for one in bagreel::commands::info(&mission).figures {
            let drawn = figure(bag, &["--kind", one.figure]);
            assert!(drawn.is_ok(), "{} {}: {drawn:?}", bag.display(), one.figure);
        }
    }
}
