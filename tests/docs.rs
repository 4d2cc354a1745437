//! Tests of README and docs: their commands run, their links are valid, and their tables match the code.

use std::collections::BTreeSet;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};

use bagreel::internals::evidence::SOURCES;
use bagreel::internals::export::FORMATS;

use crate::support::{browser, snapshot};

const README: &str = include_str!("../README.md");

fn root() -> &'static Path {
    Path::new(env!("CARGO_MANIFEST_DIR"))
}

/// The README and every chapter of the docs: path and text.
fn pages() -> Vec<(PathBuf, String)> {
    let chapters = fs::read_dir(root().join("docs/src")).unwrap();
    let chapters = chapters.map(|entry| entry.unwrap().path());
    let mut paths: Vec<PathBuf> = chapters
        .filter(|path| path.extension().is_some_and(|e| e == "md"))
        .collect();
    paths.push(root().join("README.md"));
    paths.sort();
    let read = |path: PathBuf| (path.clone(), fs::read_to_string(path).unwrap());
    paths.into_iter().map(read).collect()
}

fn chapter(name: &str) -> String {
    fs::read_to_string(root().join("docs/src").join(name)).unwrap()
}

/// The first cell of each row of the table that begins with this head, without quotes.
fn first_cells(text: &str, head: &str) -> Vec<String> {
    let table = text.split(head).nth(1).unwrap_or_default();
    let rows = table
        .lines()
        .skip(2)
        .take_while(|line| line.starts_with('|'));
    rows.map(|row| {
        row.split('|')
            .nth(1)
            .unwrap()
            .trim()
            .replace(['`', '.'], "")
    })
    .collect()
}

/// The commands of `bagreel` in the shell blocks of a page.
fn commands(text: &str) -> Vec<&str> {
    let blocks = text
        .split("```sh\n")
        .skip(1)
        .filter_map(|rest| rest.split("```").next());
    blocks
        .flat_map(str::lines)
        .filter(|line| line.starts_with("bagreel "))
        .collect()
}

/// The words of a command line; quotes keep spaces.
fn words(command: &str) -> Vec<String> {
    let mut words = vec![String::new()];
    let mut quote = None;
    for c in command.chars() {
        match (c, quote) {
            ('\'' | '"', None) => quote = Some(c),
            (c, Some(q)) if c == q => quote = None,
            (' ', None) => words.push(String::new()),
            (c, _) => words.last_mut().unwrap().push(c),
        }
    }
    words.into_iter().filter(|word| !word.is_empty()).collect()
}

/// A folder with the files used in README and docs: the examples, and an expectations file.
fn folder() -> tempfile::TempDir {
    let dir = tempfile::tempdir().unwrap();
    let examples = root().join("examples");
    let copy = |from: &Path, to: &str| {
        let to = dir.path().join(to);
        fs::create_dir_all(to.parent().unwrap()).unwrap();
        fs::copy(from, to).unwrap();
    };
    for name in [
        "run.bag",
        "good.bag",
        "warehouse.bag",
        "examples/warehouse.bag",
        "bags/day1/a.bag",
    ] {
        copy(&examples.join("warehouse.bag"), name);
    }
    for name in ["run.mcap", "courier.mcap", "bags/b.mcap"] {
        copy(&examples.join("courier.mcap"), name);
    }
    for name in ["courier_0.db3", "metadata.yaml"] {
        copy(&examples.join("courier").join(name), &format!("run/{name}"));
    }
    let topology = "nodes:\n  /rviz: {subscribes: [/robot1/plan]}\n";
    fs::write(dir.path().join("topology.yaml"), topology).unwrap();
    copy(&examples.join("paper/phases.txt"), "phases.txt");
    copy(
        &root().join("docs/src/how-it-works.json"),
        "how-it-works.json",
    );
    fs::create_dir(dir.path().join("images")).unwrap();
    dir
}

fn run(command: &str, dir: &Path) -> Output {
    Command::new(env!("CARGO_BIN_EXE_bagreel"))
        .current_dir(dir)
        .args(&words(command)[1..])
        .output()
        .unwrap()
}

#[test]
fn readme_begins_with_the_two_commands() {
    let block = README.split("```sh\n").nth(1).unwrap();
    let block = block.split("```").next().unwrap();
    let commands: Vec<&str> = block
        .lines()
        .map(|line| line.split('#').next().unwrap().trim())
        .collect();
    assert_eq!(
        commands,
        [
            "cargo run --release -- render examples/warehouse.bag",
            "cargo test --release"
        ]
    );
    let words = README.split_whitespace().count();
    assert!(words <= 900, "the README has {words} words");
}

#[test]
fn readme_shows_the_chart_of_the_example_report() {
    let report = fs::read_to_string(root().join("examples/ci/out/summary.md")).unwrap();
    let chart = |text: &str| {
        let chart = text.split("```mermaid\n").nth(1).unwrap();
        chart.split("```").next().unwrap().to_owned()
    };
    assert_eq!(chart(README), chart(&report));
}

/// The rows of the table of words: the term, and what it is not called.
fn terms() -> Vec<(String, Vec<String>)> {
    let text = chapter("words.md");
    let table = text.split("| word | meaning | not |").nth(1).unwrap();
    let rows = table.lines().skip(2).take_while(|l| l.starts_with('|'));
    let rows = rows.map(|row| {
        let cells: Vec<&str> = row.split('|').map(str::trim).collect();
        let others = cells[3].split(", ").map(str::to_owned).collect();
        (cells[1].replace('*', ""), others)
    });
    rows.collect()
}

/// The words of a text that another term of the table replaces, also in the plural, and counts that do not say `changes`.
fn other_words(text: &str) -> Vec<String> {
    let plain = text
        .to_lowercase()
        .replace(|c: char| !c.is_alphanumeric() && c != '-', " ");
    let words: Vec<&str> = plain.split_whitespace().collect();
    let singular = |word: &str| match word.strip_suffix("ies") {
        Some(stem) => format!("{stem}y"),
        None => word.trim_end_matches('s').to_owned(),
    };
    let text = words.iter().map(|word| singular(word));
    let text = format!(" {} ", text.collect::<Vec<_>>().join(" "));
    let others = terms().into_iter().flat_map(|(_, others)| others);
    let others = others.filter(|other| {
        let other = other.split(' ').map(singular).collect::<Vec<_>>();
        text.contains(&format!(" {} ", other.join(" ")))
    });
    let counts = words.windows(2).filter(|pair| {
        let is_count = pair[0].chars().all(|c| c.is_ascii_digit());
        is_count && ["events", "reconfigurations"].contains(&pair[1])
    });
    others.chain(counts.map(|pair| pair.join(" "))).collect()
}

/// The texts in quotes of a line of a program, without the values in templates.
fn quoted(line: &str) -> Vec<String> {
    let (mut texts, mut text, mut quote, mut depth) = (Vec::new(), String::new(), None, 0);
    let mut characters = line.chars().peekable();
    while let Some(c) = characters.next() {
        match (c, quote) {
            ('\\', _) => {
                characters.next();
            }
            ('\'' | '"' | '`', None) => quote = Some(c),
            ('$', Some('`')) if characters.peek() == Some(&'{') => depth += 1,
            ('}', Some('`')) if depth > 0 => depth -= 1,
            (c, Some(q)) if c == q && depth == 0 => {
                texts.push(std::mem::take(&mut text));
                quote = None;
            }
            (c, Some(_)) if depth == 0 => text.push(c),
            _ => {}
        }
    }
    texts
}

/// The text of a page without its program and its tags, and the sentences in its program.
fn words_of_page(page: &str) -> String {
    let mut text = String::new();
    for (at, part) in page.split("<script").enumerate() {
        let (program, rest) = part.split_once("</script>").unwrap_or(("", part));
        let rest = if at == 0 { part } else { rest };
        let styled = rest.split("<style");
        let rest = styled.map(|own| own.split_once("</style>").map_or(own, |(_, rest)| rest));
        let outside = rest.flat_map(|rest| rest.split('>').filter_map(|tag| tag.split('<').next()));
        text.extend(outside.flat_map(|words| [words, " "]));
        let sentences = program.lines().flat_map(quoted);
        let sentences = sentences.filter(|words| words.contains(' '));
        text.extend(sentences.flat_map(|words| [words, " ".to_owned()]));
    }
    text
}

#[test]
fn help_docs_and_outputs_use_the_words_of_the_table_and_no_other() {
    let terms: Vec<String> = terms().into_iter().map(|(term, _)| term).collect();
    for term in [
        "event",
        "change",
        "reconfiguration",
        "phase",
        "step",
        "window",
        "rule, finding",
        "rate while sending",
        "rate over the recording",
    ] {
        assert!(terms.iter().any(|own| own == term), "{term}: {terms:?}");
    }
    let dir = folder();
    let here = dir.path();
    let graph = root().join("examples/ci/graph.yaml");
    fs::copy(graph, here.join("graph.yaml")).unwrap();
    let mut texts: Vec<(String, String)> = Vec::new();
    let written = [
        "README.md",
        "CHANGELOG.md",
        "examples/README.md",
        "python/README.md",
        "python/bagreel/__init__.py",
    ];
    let written = written.map(|name| root().join(name));
    let chapters = pages().into_iter().map(|(path, _)| path);
    for path in chapters
        .chain(written)
        .filter(|path| !path.ends_with("words.md"))
    {
        let text = fs::read_to_string(&path).unwrap();
        // The table of the changelog has the words of old versions.
        let is_old = |line: &&str| path.ends_with("CHANGELOG.md") && line.starts_with('|');
        let text: Vec<&str> = text.lines().filter(|line| !is_old(line)).collect();
        texts.push((path.display().to_string(), text.join("\n")));
    }
    for command in &help_commands() {
        texts.push((command.clone(), help(&[command, "--help"])));
        texts.push((command.clone(), help(&["man", command])));
    }
    for command in [
        "info run.bag",
        "info run.mcap --why /cmd_vel",
        "info bags",
        "events run.bag --phases auto --parts --all",
        "events run.mcap --format csv",
        "events run.mcap --format markdown",
        "diff run.bag run.mcap",
        "diff run.bag run.mcap --format markdown",
        "render run.bag --period 30 -o out/x.html -o out/x.md -o out/x.csv -o out/x.svg",
        "figure run.bag -o out/f.svg -o out/f.tex",
        "check run.mcap --expect graph.yaml",
        "check run.mcap --expect graph.yaml --format junit",
        "check run.mcap --expect graph.yaml --format markdown",
        "follow run.mcap --expect graph.yaml",
        "baseline run.mcap",
        "extract run.bag -o out/m.csv --start 0 --end 1",
        "tables bags -o out/t",
        "render run.bag --topic-filter /nosuch",
        "figure run.mcap --kind holders",
    ] {
        let output = run(&format!("bagreel {command}"), here);
        let text = [output.stdout, output.stderr].map(|bytes| String::from_utf8(bytes).unwrap());
        assert!(!text.concat().is_empty(), "{command}");
        texts.push((command.to_owned(), text.concat()));
    }
    for file in fs::read_dir(here.join("out")).unwrap() {
        let path = file.unwrap().path();
        let Ok(text) = fs::read_to_string(&path) else {
            continue;
        };
        // A table has words of its own in its head only: the rest are names of the bag.
        let text = match path.extension().and_then(|e| e.to_str()) {
            Some("html" | "svg") => words_of_page(&text),
            Some("csv") => text.lines().next().unwrap().to_owned(),
            _ => text,
        };
        texts.push((path.display().to_string(), text));
    }
    let kinds = texts.len();
    let wrong = texts.iter().flat_map(|(name, text)| {
        let words = other_words(text).into_iter();
        words.map(move |word| format!("{name}: {word}"))
    });
    assert_eq!(wrong.collect::<Vec<String>>(), [""; 0]);
    assert!(kinds > 60, "{kinds} texts");
}

#[test]
fn another_word_for_a_term_is_found() {
    for text in [
        "The ledger has 42 changes.",
        "`x.ledgers.csv`",
        "Entries:",
        "at a mean rate of 5 Hz",
        "42 events",
        "the stages of a mission",
    ] {
        assert_eq!(other_words(text).len(), 1, "{text}");
    }
    assert_eq!(
        other_words("42 changes in 3 phases, 5 Hz while sending"),
        [""; 0]
    );
    let page = "<p id=\"entry\">a <b>stage</b><script>f('no entry', entry)</script> end";
    assert_eq!(other_words(&words_of_page(page)).len(), 2);
}

/// The whole number before each `changes` in a text.
fn counted_changes(text: &str) -> Vec<usize> {
    let words: Vec<&str> = text.split_whitespace().collect();
    let pairs = words.windows(2);
    let pairs =
        pairs.filter(|pair| pair[1].trim_matches(|c: char| !c.is_alphabetic()) == "changes");
    pairs.filter_map(|pair| pair[0].parse().ok()).collect()
}

#[test]
fn every_output_counts_the_same_changes() {
    let dir = folder();
    for bag in ["run.bag", "run.mcap"] {
        let printed = |command: &str| {
            let output = run(&command.replace("BAG", bag), dir.path());
            let text = [output.stdout, output.stderr].concat();
            String::from_utf8(text).unwrap()
        };
        let changes = printed("bagreel events BAG --format ndjson")
            .lines()
            .count();
        assert!(changes > 10, "{bag}: {changes}");
        for command in [
            "bagreel info BAG",
            "bagreel events BAG",
            "bagreel render BAG -o x.md",
            "bagreel figure BAG -o x.svg",
        ] {
            let counts = counted_changes(&printed(command));
            assert_eq!(counts.first(), Some(&changes), "{command}");
        }
        let report = fs::read_to_string(dir.path().join("x.md")).unwrap();
        assert_eq!(counted_changes(&report).first(), Some(&changes), "{bag}");
        let rows = printed("bagreel info BAG --format csv");
        let mut rows = rows.lines().map(|row| row.split(',').collect::<Vec<_>>());
        let (heads, row) = (rows.next().unwrap(), rows.next().unwrap());
        let of = |name: &str| -> usize {
            let at = heads.iter().position(|head| *head == name).unwrap();
            row[at].parse().unwrap()
        };
        let kinds = ["starts", "stops", "restarts", "rates"].map(of);
        assert!(kinds.iter().sum::<usize>() <= changes, "{bag}: {kinds:?}");
    }
}

/// Each block of output on a page, with the commands of the block before it.
fn shown_outputs(text: &str) -> Vec<(Vec<&str>, Vec<&str>)> {
    let mut blocks = text.split("```").skip(1).step_by(2).peekable();
    let mut shown = Vec::new();
    while let Some(block) = blocks.next() {
        let output = blocks.peek().and_then(|next| next.strip_prefix("text\n"));
        if let (Some(script), Some(output)) = (block.strip_prefix("sh\n"), output) {
            let commands = script.lines().filter(|line| line.starts_with("bagreel "));
            shown.push((commands.collect(), output.lines().collect()));
        }
    }
    shown
}

#[test]
fn commands_print_what_the_pages_show() {
    let mut compared = 0;
    for (path, text) in pages() {
        let blocks = text.matches("```text\n").count();
        let shown = shown_outputs(&text);
        assert_eq!(
            shown.len(),
            blocks,
            "{}: output without a command",
            path.display()
        );
        let dir = folder();
        for (own, lines) in shown {
            let outputs = own.iter().map(|command| run(command, dir.path()).stdout);
            let outputs = String::from_utf8(outputs.collect::<Vec<_>>().concat()).unwrap();
            let printed: Vec<&str> = outputs.lines().collect();
            let mut rest = &printed[..];
            for part in lines.split(|line| *line == "…") {
                let at = rest.windows(part.len()).position(|own| own == part);
                let at = at.unwrap_or_else(|| {
                    panic!("{}: {part:#?}\nis not in\n{outputs}", path.display())
                });
                rest = &rest[at + part.len()..];
            }
            compared += 1;
        }
    }
    assert!(compared >= 6, "{compared} outputs");
}

#[test]
fn docs_list_every_output_format_and_every_kind_of_evidence() {
    let rows = first_cells(&chapter("outputs.md"), "| extension | output |");
    let formats: Vec<&str> = FORMATS.iter().map(|f| f.word).collect();
    assert_eq!(rows, formats);
    let rows = first_cells(&chapter("evidence.md"), "| evidence | what it reveals |");
    let sources: Vec<&str> = SOURCES.iter().map(|s| s.word).collect();
    assert_eq!(rows, sources);
    let counted = format!("[{} kinds of evidence]", SOURCES.len());
    assert!(README.contains(&counted), "{counted}");
}

#[test]
fn every_command_of_readme_and_docs_runs() {
    let pages = pages();
    let mut tried = 0;
    for (path, text) in &pages {
        if path.ends_with("gallery.md") {
            continue;
        }
        let dir = folder();
        for command in commands(text) {
            let output = run(command, dir.path());
            let said = String::from_utf8_lossy(&output.stderr);
            // Equal missions have no differences, and a run matches its own baseline.
            assert_eq!(
                output.status.code(),
                Some(0),
                "{}: {command}: {said}",
                path.display()
            );
            tried += 1;
        }
    }
    assert!(tried > 60, "{tried} commands");
}

/// The number of bytes that all pictures of the docs may have.
const MOST_BYTES: u64 = 3_000_000;

/// `SNAPSHOTS=new` rewrites the pictures. Pixels are only reproducible on one kind of processor.
#[test]
fn gallery_shows_what_its_commands_draw() {
    let (gallery, dir) = (chapter("gallery.md"), folder());
    let images = root().join("docs/src/images");
    let is_new = snapshot::is_new();
    let (mut shown, mut stale) = (0, Vec::new());
    for part in gallery.split("](images/").skip(1) {
        let (name, rest) = part.split_once(')').unwrap();
        let command = commands(rest)[0];
        assert!(
            command
                .replace("{n}", "0")
                .ends_with(&format!(" -o images/{name}")),
            "{command}"
        );
        let output = run(command, dir.path());
        let said = String::from_utf8_lossy(&output.stderr);
        assert!(output.status.success(), "{command}: {said}");
        let drawn = fs::read(dir.path().join("images").join(name)).unwrap();
        let is_text = is_svg(name);
        if is_new {
            fs::write(images.join(name), &drawn).unwrap();
        } else if is_text || cfg!(target_arch = "x86_64") {
            let is_same = fs::read(images.join(name)).is_ok_and(|old| old == drawn);
            stale.extend((!is_same).then_some(name));
        }
        shown += 1;
    }
    assert_eq!(
        stale,
        Vec::<&str>::new(),
        "draw them anew with SNAPSHOTS=new"
    );
    assert_eq!(shown, 20);
    let files = fs::read_dir(images).unwrap();
    let bytes: u64 = files
        .map(|file| file.unwrap().metadata().unwrap().len())
        .sum();
    assert!(bytes <= MOST_BYTES, "{bytes} bytes of pictures");
}

fn is_svg(name: &str) -> bool {
    Path::new(name).extension().is_some_and(|e| e == "svg")
}

/// The film at the top. `SNAPSHOTS=new` rewrites it.
#[test]
fn readme_film_is_drawn_by_the_command_below_it() {
    let (_, rest) = README.split_once("](examples/warehouse.gif)").unwrap();
    let command = rest
        .lines()
        .find_map(|line| line.strip_prefix("$ "))
        .unwrap();
    let dir = folder();
    let output = run(command, dir.path());
    assert!(output.status.success(), "{command}: {output:?}");
    let film = "examples/warehouse.gif";
    let drawn = fs::read(dir.path().join(film)).unwrap();
    if snapshot::is_new() {
        fs::write(root().join(film), drawn).unwrap();
    } else if cfg!(target_arch = "x86_64") {
        let is_same = fs::read(root().join(film)).unwrap() == drawn;
        assert!(is_same, "draw it anew with SNAPSHOTS=new");
    }
}

/// Only the SVG pictures: the page is a screenshot.
#[test]
fn readme_pictures_are_drawn_by_the_commands_below_them() {
    let (dir, mut shown) = (folder(), 0);
    for part in README.split("<img src=\"docs/src/images/").skip(1) {
        let (name, rest) = part.split_once('"').unwrap();
        let command = commands(rest)[0];
        if is_svg(name) {
            let output = run(command, dir.path());
            assert!(output.status.success(), "{command}: {output:?}");
            let outputs = words(command);
            let drawn = outputs.iter().find(|word| is_svg(word)).unwrap();
            let expected = fs::read(root().join("docs/src/images").join(name)).unwrap();
            let drawn = fs::read(dir.path().join(drawn)).unwrap();
            assert!(drawn == expected, "{name} differs from `{command}`");
            shown += 1;
        }
    }
    assert_eq!(shown, 2);
}

/// The mean brightness of each square of 8 × 8 pixels: letters of another font are as dark as those of this one.
fn squares(picture: &[u8]) -> Vec<f64> {
    let grey = image::load_from_memory(picture).unwrap().into_luma8();
    let (width, height) = (grey.width() / 8, grey.height() / 8);
    let mut squares = vec![0.0; (width * height) as usize];
    for (x, y, pixel) in grey.enumerate_pixels() {
        if x / 8 < width && y / 8 < height {
            squares[(y / 8 * width + x / 8) as usize] += f64::from(pixel.0[0]) / 64.0;
        }
    }
    squares
}

#[test]
fn readme_picture_of_the_page_is_current() {
    let dir = folder();
    let (_, rest) = README.split_once("page.webp").unwrap();
    let output = run(commands(rest)[0], dir.path());
    assert!(output.status.success(), "{output:?}");
    let taken = dir.path().join("page.webp");
    browser::drive("page.py", [dir.path().join("run.html"), taken.clone()]);
    let Ok(taken) = fs::read(taken) else {
        return;
    };
    let shown = fs::read(root().join("docs/src/images/page.webp")).unwrap();
    let (taken, shown) = (squares(&taken), squares(&shown));
    assert_eq!(taken.len(), shown.len());
    let pairs = taken.iter().zip(&shown);
    let other = pairs.filter(|(a, b)| (*a - *b).abs() > 16.0).count();
    let share = other as f64 / shown.len() as f64;
    assert!(
        share < 0.02,
        "{:.1} % of the picture differ: tests/browser/page.py takes it anew",
        share * 100.0
    );
}

/// The anchor that mdBook and GitHub give to a heading.
fn heading_id(heading: &str) -> String {
    let text = heading.trim_start_matches('#').trim().to_lowercase();
    let kept = text
        .chars()
        .filter(|c| c.is_alphanumeric() || " -_".contains(*c));
    kept.collect::<String>().replace(' ', "-")
}

#[test]
fn links_in_readme_and_docs_are_valid() {
    let mut seen = 0;
    for (path, text) in pages() {
        let folder = path.parent().unwrap();
        // Code blocks contain examples.
        let text: String = text.split("```").step_by(2).collect();
        let targets = text
            .split("](")
            .skip(1)
            .filter_map(|rest| rest.split(')').next())
            .chain(
                text.split("src=\"")
                    .skip(1)
                    .filter_map(|rest| rest.split('"').next()),
            )
            .chain(
                text.split("href=\"")
                    .skip(1)
                    .filter_map(|rest| rest.split('"').next()),
            );
        for target in targets.filter(|target| !target.starts_with("https://")) {
            let file = target.split('#').next().unwrap();
            assert!(folder.join(file).exists(), "{}: {target}", path.display());
            if let Some((_, anchor)) = target.split_once('#') {
                let file = if file.is_empty() {
                    path.clone()
                } else {
                    folder.join(file)
                };
                let text = fs::read_to_string(file).unwrap();
                let mut headings = text.lines().filter_map(|l| l.strip_prefix('#'));
                let is_known = headings.any(|heading| heading_id(heading) == anchor);
                assert!(is_known, "{}: {target}", path.display());
            }
            seen += 1;
        }
    }
    let summary = chapter("SUMMARY.md");
    for (path, _) in pages() {
        let name = path.file_name().unwrap().to_str().unwrap();
        let is_listed =
            ["README.md", "SUMMARY.md"].contains(&name) || summary.contains(&format!("({name})"));
        assert!(is_listed, "{name} is not in SUMMARY.md");
    }
    assert!(seen > 40, "{seen} links");
}

fn help(args: &[&str]) -> String {
    let run = Command::new(env!("CARGO_BIN_EXE_bagreel"))
        .args(args)
        .output()
        .unwrap();
    String::from_utf8(run.stdout).unwrap()
}

/// The commands that `bagreel --help` lists, without `help` itself.
fn help_commands() -> Vec<String> {
    let list = help(&["--help"]);
    let commands = list.lines().skip_while(|l| *l != "Commands:").skip(1);
    commands
        .take_while(|l| !l.is_empty())
        .filter(|l| l.starts_with("  ") && !l.starts_with("   "))
        .filter_map(|l| l.split_whitespace().next())
        .filter(|command| *command != "help")
        .map(str::to_owned)
        .collect()
}

/// The number of lines of a screen of help.
const SCREEN: usize = 50;

#[test]
fn short_help_fits_a_screen_and_its_examples_run() {
    let dir = folder();
    for command in &help_commands() {
        let short = help(&[command, "-h"]);
        assert!(short.lines().count() <= SCREEN, "{short}");
        let examples = short.split("Examples:\n").nth(1).unwrap();
        let examples = examples.lines().map(str::trim_start);
        let examples: Vec<&str> = examples.filter(|l| l.starts_with("bagreel ")).collect();
        assert_eq!(examples.len(), 3, "{short}");
        for example in examples {
            let end = example.find("  ").unwrap_or(example.len());
            let example = example[..end].split(['>', '|']).next().unwrap().trim();
            // Following waits for a recording that grows.
            if example.starts_with("bagreel follow") {
                continue;
            }
            let output = run(example, dir.path());
            let said = String::from_utf8_lossy(&output.stderr);
            assert_eq!(output.status.code(), Some(0), "{example}: {said}");
        }
    }
}

#[test]
fn long_help_lists_every_option_under_a_heading() {
    let general = ["--quiet", "--verbose", "--color", "--help"];
    for command in &help_commands() {
        let long = help(&[command, "--help"]);
        let plain = long.split("\nOptions:\n").nth(1).unwrap();
        // The next heading begins a line.
        let plain = plain
            .lines()
            .take_while(|l| l.is_empty() || l.starts_with(' '));
        let plain = plain.filter(|l| l.trim_start().starts_with('-'));
        for line in plain {
            assert!(
                general.iter().any(|o| line.contains(o)),
                "{command}: {line}"
            );
        }
    }
}

#[test]
fn docs_describe_every_option() {
    let docs: String = pages().into_iter().map(|(_, text)| text).collect();
    let help = |command: &str| help(&[command, "--help"]);
    let mut options = BTreeSet::new();
    for command in &help_commands() {
        assert!(docs.contains(&format!("bagreel {command}")), "{command}");
        let text = help(command);
        let words = text
            .lines()
            .map(str::trim_start)
            .filter(|line| line.starts_with('-'));
        let long = words.filter_map(|line| {
            let option = line
                .split_whitespace()
                .find(|word| word.starts_with("--"))?;
            Some(option.trim_end_matches(',').to_owned())
        });
        options.extend(long);
    }
    let missing: Vec<&String> = options
        .iter()
        .filter(|option| !["--help", "--version"].contains(&option.as_str()))
        .filter(|option| !docs.contains(option.as_str()))
        .collect();
    assert!(options.len() > 50, "{options:?}");
    assert!(missing.is_empty(), "the docs do not describe {missing:?}");
}
