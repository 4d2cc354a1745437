//! Tests of the library as other programs use it.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

use bagreel::commands::{Baseline, Check, Diff, Report, baseline, check, diff};
use bagreel::values::{
    FindingKind, Fonts, Judgement, ReportFormat, Severity, SourceCode, Target, Unwatched, Where,
    topology,
};
use bagreel::{Error, Mission, Output, Reading, Render, read, render};

use crate::gate::bagreel;

/// A path in the project.
fn project(path: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join(path)
}

fn text(bytes: &[u8]) -> String {
    String::from_utf8(bytes.to_vec()).unwrap()
}

/// The examples of the repository run as their first lines say.
#[test]
fn every_example_program_runs_as_it_says() {
    let command = Path::new(env!("CARGO_BIN_EXE_bagreel"));
    let built = command.parent().unwrap().join("examples");
    let folder = tempfile::tempdir().unwrap();
    for entry in fs::read_dir(project("examples")).unwrap() {
        let path = entry.unwrap().path();
        if path.extension().is_none_or(|end| end != "rs") {
            continue;
        }
        let name = path.file_stem().unwrap().to_str().unwrap();
        let program = built
            .join(name)
            .with_extension(std::env::consts::EXE_EXTENSION);
        if !program.exists() {
            println!("skipped: `{name}` is built only when all tests run");
            continue;
        }
        let source = fs::read_to_string(&path).unwrap();
        let start = format!("//! `cargo run --release --example {name} -- ");
        let line = source
            .lines()
            .find_map(|line| line.strip_prefix(&start))
            .expect(name);
        let line = line.trim_end_matches('`').replace('\'', "");
        let here = format!("{}/", project("examples").display());
        let line = line.replace("examples/", &here);
        let mut run = Command::new(&program);
        run.current_dir(folder.path()).args(line.split(' '));
        let done = run.output().unwrap();
        assert!(done.status.success(), "{name}: {}", text(&done.stderr));
        assert!(
            text(&done.stdout).lines().count() >= 1,
            "{name} prints nothing"
        );
    }
}

#[test]
fn a_program_writes_a_baseline_and_checks_missions_against_it() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("graph.yaml");
    let courier = || Reading::of([project("examples/courier.mcap")]);
    let job = Baseline::new(vec![courier()], Target::Path(file.clone()));
    let written = baseline(&job, &mut Unwatched).unwrap();
    assert_eq!((written.missions.len(), written.left_out), (1, 0));
    assert!(written.nodes > 5 && written.topics > 5, "{written:?}");

    let mut job = Check::new(courier(), &file);
    let junit = folder.path().join("check.xml");
    job.reports = vec![Report::parse(junit.to_str().unwrap()).unwrap()];
    let done = check(&job, &mut Unwatched).unwrap();
    assert_eq!(done.verdict.count(Severity::Error), 0);
    assert!(done.verdict.facts(Judgement::Kept) > 20 && !done.verdict.is_blind());
    assert!(fs::read_to_string(&junit).unwrap().contains("<testsuite"));

    // A rate that the lidar does not reach.
    let graph = fs::read_to_string(&file).unwrap();
    let scan = graph
        .lines()
        .find(|line| line.starts_with("  /scan:"))
        .unwrap();
    let wrong = "  /scan: {type: sensor_msgs/msg/LaserScan, hz: 50..60}";
    fs::write(&file, graph.replace(scan, wrong)).unwrap();
    job.reports.clear();
    let done = check(&job, &mut Unwatched).unwrap();
    let findings = done.verdict.findings();
    let all: Vec<_> = findings
        .iter()
        .map(|f| (f.kind, f.name.as_str(), f.severity))
        .collect();
    assert_eq!(all, [(FindingKind::TopicRateLow, "/scan", Severity::Error)]);
    let line = 1 + graph.lines().position(|line| line == scan).unwrap();
    assert_eq!(findings[0].place.line, line);
    assert_eq!(
        FindingKind::from_word("topic-rate-low"),
        Some(findings[0].kind)
    );

    // The command reports the same.
    job.bags = vec!["courier.mcap".to_owned()];
    fs::copy(
        project("examples/courier.mcap"),
        folder.path().join("courier.mcap"),
    )
    .unwrap();
    job.expect = "graph.yaml".into();
    job.tracked = "graph.yaml".to_owned();
    let args = "check courier.mcap --expect graph.yaml --format json";
    let told = bagreel(folder.path(), &args.split(' ').collect::<Vec<_>>());
    assert_eq!(told.status.code(), Some(1));
    let json = ReportFormat::from_word("json").unwrap();
    assert_eq!(job.report(&done, json), text(&told.stdout));

    assert!(matches!(
        Report::parse("check.exe"),
        Err(Error::Usage { .. })
    ));
    job.expect = folder.path().join("none.yaml");
    assert!(check(&job, &mut Unwatched).is_err());
}

#[test]
fn a_program_compares_two_missions() {
    let bags = ["examples/courier.mcap", "examples/warehouse.bag"];
    let reading = |bag: &str| Reading::of([project(bag)]);
    let same = Diff::new([reading(bags[0]), reading(bags[0])]).unwrap();
    assert_eq!(diff(&same, &mut Unwatched).unwrap().differences, []);

    let folder = tempfile::tempdir().unwrap();
    let mut job = Diff::new(bags.map(reading)).unwrap();
    assert_eq!(
        (job.subject.first.as_str(), job.subject.second.as_str()),
        ("courier.mcap", "warehouse.bag")
    );
    for name in ["d.md", "d.svg"] {
        job.write(folder.path().join(name).as_os_str()).unwrap();
    }
    assert!(job.write("d.csv".as_ref()).is_err() && job.write("d".as_ref()).is_err());
    let done = diff(&job, &mut Unwatched).unwrap();
    let amcl = done
        .differences
        .iter()
        .find(|d| (d.kind, d.name.as_str()) == ("node", "/amcl"));
    assert_eq!(amcl.unwrap().side, Where::First);
    assert_eq!(done.missions[1].bags[0].name, "warehouse.bag");
    let markdown = fs::read_to_string(folder.path().join("d.md")).unwrap();
    assert!(markdown.contains("/amcl"), "{markdown}");
    assert!(
        fs::read_to_string(folder.path().join("d.svg"))
            .unwrap()
            .contains("/amcl")
    );

    let args = "diff courier.mcap warehouse.bag --format json";
    let told = bagreel(&project("examples"), &args.split(' ').collect::<Vec<_>>());
    let json = ReportFormat::from_word("json").unwrap();
    assert_eq!(job.report(&done.differences, json), text(&told.stdout));
}

/// What `--topology`, `--source` and `--font` set, set from Rust.
#[test]
fn a_program_gives_a_topology_source_code_and_a_font() {
    let folder = tempfile::tempdir().unwrap();
    let file = |name: &str| folder.path().join(name);
    let table = "Name,Publish,Subscribe,Node-start,Node-end\n/logger,[],['/scan'],0,10\n";
    fs::write(file("graph.csv"), table).unwrap();
    let mut reading = Reading::of([project("examples/courier.mcap")]);
    let is_logger = |mission: &Mission| {
        let mut nodes = mission.elements.nodes.iter();
        nodes.any(|node| node.name.as_str() == "/logger")
    };
    assert!(!is_logger(&read(&reading).unwrap()));
    reading.conclude.topology = topology::read(&file("graph.csv")).unwrap();
    reading.code = Some(SourceCode {
        folder: file("missing"),
        infers: false,
    });
    assert!(read(&reading).is_err(), "the folder does not exist");
    reading.code.as_mut().unwrap().folder = folder.path().to_owned();
    assert!(is_logger(&read(&reading).unwrap()));

    let picture = Output::named(file("graph.svg").as_os_str(), None).unwrap();
    let mut job = Render::new(reading, vec![picture]).unwrap();
    let font = project("styles/fonts/Inter-Regular.ttf");
    let fonts = Fonts::bundled().with(fs::read(&font).unwrap(), &font);
    job.drawing.fonts = fonts.unwrap();
    assert_eq!(job.drawing.fonts.files().count(), 3);
    assert_eq!(render(&job).unwrap().written[0].files, 1);
    let picture = fs::read_to_string(file("graph.svg")).unwrap();
    assert!(picture.contains("/logger"), "{picture}");
}
