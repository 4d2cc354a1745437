//! Figures for papers: exact on paper, never too small to read, nothing over anything.

use std::path::{Path, PathBuf};
use std::process::Command;

/// The text of a figure as SVG, or what the command said against it.
fn figure(bag: &Path, flags: &[&str]) -> Result<String, String> {
    let folder = tempfile::tempdir().unwrap();
    let svg = folder.path().join("figure.svg");
    let out = Command::new(env!("CARGO_BIN_EXE_bagreel"))
        .args(["render", "--quiet"])
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

/// The width and height in millimetres that the page says.
fn size_mm(svg: &str) -> (f64, f64) {
    let of = |name: &str| {
        let from = svg.find(&format!(" {name}=\"")).unwrap() + name.len() + 3;
        svg[from..].split("mm\"").next().unwrap().parse().unwrap()
    };
    (of("width"), of("height"))
}

#[test]
fn lives_of_the_example_are_as_wide_as_asked_and_no_higher_than_a_column() {
    let svg = figure(&example(), &["--figure", "lives", "--width", "88mm"]).unwrap();
    let (width, height) = size_mm(&svg);
    assert!((width - 88.0).abs() < 0.1, "{width}");
    assert!((60.0..=110.0).contains(&height), "{height}");
    let svg = figure(&example(), &["--figure", "lives", "--width", "181mm"]).unwrap();
    let (width, height) = size_mm(&svg);
    assert!((width - 181.0).abs() < 0.1, "{width}");
    assert!((60.0..=94.0).contains(&height), "{height}");
}

#[test]
fn lives_tell_what_happened_in_words() {
    let svg = figure(&example(), &["--figure", "lives"]).unwrap();
    for expected in [
        "8 nodes throughout",
        "lidar_driver back after",
        "topic changes hands",
    ] {
        assert!(svg.contains(expected), "{expected}");
    }
}

/// Font sizes in points.
fn sizes_pt(svg: &str) -> Vec<f64> {
    let all = svg.split("font-size=\"").skip(1);
    let px = all.map(|rest| rest.split('"').next().unwrap().parse::<f64>().unwrap());
    px.map(|px| px * 0.75).collect()
}

#[test]
fn no_text_is_below_six_points() {
    for width in ["60mm", "88mm", "181mm"] {
        let svg = figure(&example(), &["--figure", "lives", "--width", width]).unwrap();
        let smallest = sizes_pt(&svg).into_iter().fold(f64::MAX, f64::min);
        assert!((5.95..=7.0).contains(&smallest), "{width}: {smallest}");
    }
    let svg = figure(&example(), &["--figure", "lives", "--text", "8pt"]).unwrap();
    let smallest = sizes_pt(&svg).into_iter().fold(f64::MAX, f64::min);
    assert!(smallest >= 6.95, "{smallest}");
}

#[test]
fn what_does_not_fit_is_refused_with_what_would() {
    let narrow = figure(&example(), &["--figure", "lives", "--width", "21mm"]).unwrap_err();
    let enough = narrow
        .split("--width ")
        .nth(1)
        .unwrap()
        .split('`')
        .next()
        .unwrap();
    assert!(
        figure(&example(), &["--figure", "lives", "--width", enough]).is_ok(),
        "{narrow}"
    );
    let nothing = figure(&example(), &["--figure", "lives", "--ns-filter", "/nobody"]).unwrap_err();
    assert!(nothing.contains("nothing is left to draw"), "{nothing}");
}

#[test]
fn options_that_say_nothing_to_a_figure_are_refused() {
    for flags in [
        &["--figure", "lives", "--strip", "3x2"][..],
        &["--figure", "lives", "--style", "dark"],
        &["--figure", "lives", "--steps", "3"],
        &["--rows", "groups"],
        &["--text", "8pt"],
        &["--figure", "lives", "--text", "5pt"],
    ] {
        assert!(figure(&example(), flags).is_err(), "{flags:?}");
    }
}
