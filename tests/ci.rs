//! Tests of the jobs in `examples/ci/`, whose commands run and reproduce the stored outputs, and of what is packaged.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

fn folder() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("examples/ci")
}

/// A job's working folder: the recording, the expectations, and an empty summary.
fn place() -> tempfile::TempDir {
    let dir = tempfile::tempdir().unwrap();
    fs::create_dir(dir.path().join("out")).unwrap();
    let bag = folder().join("../courier.mcap");
    fs::copy(bag, dir.path().join("out/nav_test.mcap")).unwrap();
    for name in ["minimal.yaml", "graph.yaml", "rules.yaml"] {
        fs::copy(folder().join(name), dir.path().join(name)).unwrap();
    }
    dir
}

/// Every `bagreel` command in a job, in order.
fn commands(job: &str) -> Vec<String> {
    let text = fs::read_to_string(folder().join(job)).unwrap();
    let lines = text
        .lines()
        .map(|line| line.trim().trim_start_matches("- "));
    lines
        .filter(|line| line.starts_with("bagreel "))
        .map(str::to_owned)
        .collect()
}

/// Runs a command as a job does; returns its exit code and output.
#[cfg(unix)]
fn run(dir: &Path, command: &str) -> (Option<i32>, String) {
    assert!(!command.contains("${{"), "{command}");
    let ours = Path::new(env!("CARGO_BIN_EXE_bagreel")).parent().unwrap();
    let path = format!("{}:{}", ours.display(), std::env::var("PATH").unwrap());
    let output = Command::new("sh")
        .args(["-c", command])
        .current_dir(dir)
        .env("PATH", path)
        .env("GITHUB_STEP_SUMMARY", dir.join("summary.md"))
        .output()
        .unwrap();
    (
        output.status.code(),
        String::from_utf8(output.stdout).unwrap(),
    )
}

/// Compares with a file in `examples/ci/out`; `ACCEPT=1` overwrites it.
fn same(name: &str, text: &str) {
    let path = folder().join("out").join(name);
    if std::env::var_os("ACCEPT").is_some() {
        fs::create_dir_all(folder().join("out")).unwrap();
        fs::write(&path, text).unwrap();
    }
    let kept = fs::read_to_string(&path).unwrap_or_default();
    assert_eq!(
        kept, text,
        "{name}: `ACCEPT=1 cargo test --release --test tests ci::` takes the new one"
    );
}

#[test]
#[cfg(unix)]
fn the_commands_of_ci_jobs_reproduce_the_stored_outputs() {
    let dir = place();
    let here = dir.path();
    let read = |name: &str| fs::read_to_string(here.join(name)).unwrap();
    let github = commands("github.yml");
    assert_eq!(github.len(), 2);
    assert_eq!(run(here, &github[0]).0, Some(0));
    fs::write(here.join("summary.md"), "Built.\n").unwrap();
    let (code, said) = run(here, &github[1]);
    assert_eq!(code, Some(1));
    same("github.txt", &said);
    same("check.xml", &read("check.xml"));
    let summary = read("summary.md");
    assert!(
        summary.starts_with("Built.\n\n### ❌ Graph check"),
        "{summary}"
    );
    same("summary.md", summary.strip_prefix("Built.\n\n").unwrap());
    assert!(here.join("player.html").is_file() && here.join("strip.png").is_file());
    let comment = commands("comment.yml");
    assert_eq!(comment.len(), 1);
    assert_eq!(run(here, &comment[0]).0, Some(1));
    let report = read("report.md");
    assert!(report.starts_with("### ❌ Graph check"), "{report}");
    let gitlab = commands("gitlab.yml");
    assert_eq!(gitlab.len(), 2);
    assert_eq!(run(here, &gitlab[0]).0, Some(0));
    assert_eq!(run(here, &gitlab[1]).0, Some(1));
    same("codequality.json", &read("codequality.json"));
}

#[test]
#[cfg(unix)]
fn the_three_expectations_have_the_stored_findings() {
    let dir = place();
    for (name, code) in [("minimal", 0), ("graph", 1), ("rules", 1)] {
        let command = format!(
            "bagreel check out/nav_test.mcap --expect {name}.yaml -o {name}.json -o {name}.sarif"
        );
        let (got, said) = run(dir.path(), &command);
        assert_eq!(got, Some(code), "{name}: {said}");
        same(&format!("{name}.txt"), &said);
        let sarif = fs::read_to_string(dir.path().join(format!("{name}.sarif"))).unwrap();
        if name == "graph" {
            same("graph.sarif", &sarif);
            let json = fs::read_to_string(dir.path().join("graph.json")).unwrap();
            same("graph.json", &json);
        }
    }
}

#[test]
fn third_party_actions_are_pinned() {
    for job in ["github.yml", "comment.yml", "setup-bagreel/action.yml"] {
        let text = fs::read_to_string(folder().join(job)).unwrap();
        for line in text
            .lines()
            .filter_map(|l| l.trim().trim_start_matches("- ").strip_prefix("uses: "))
        {
            let pin = line
                .split('@')
                .nth(1)
                .map_or("", |rest| rest.split(' ').next().unwrap());
            let is_pinned = pin.len() == 40 && pin.bytes().all(|b| b.is_ascii_hexdigit());
            assert!(is_pinned || line.starts_with("./"), "{job}: {line}");
        }
    }
}

/// Runs the script of `setup-bagreel` with a fake `curl` that returns an archive: whether it succeeded, the path it
/// added, and its output.
#[cfg(target_os = "linux")]
fn set_up(dir: &Path, sha256: &str) -> (bool, String, String) {
    use std::os::unix::fs::PermissionsExt as _;
    let action = fs::read_to_string(folder().join("setup-bagreel/action.yml")).unwrap();
    let (_, script) = action.split_once("run: |").unwrap();
    let (_, script) = script.split_once('\n').unwrap();
    let curl = dir.join("curl");
    fs::write(
        &curl,
        "#!/bin/sh\nfor last; do [ \"$last\" != --output ] || { shift; break; }; shift; done\ncp \"$ARCHIVE\" \"$1\"; echo \"$2\"\n",
    )
    .unwrap();
    fs::set_permissions(&curl, fs::Permissions::from_mode(0o755)).unwrap();
    fs::write(dir.join("path"), "").unwrap();
    let output = Command::new("bash")
        .args(["-c", script])
        .env(
            "PATH",
            format!("{}:{}", dir.display(), std::env::var("PATH").unwrap()),
        )
        .env("VERSION", "0.1.0")
        .env("SHA256", sha256)
        .env("FROM", "https://example.org")
        .env("ARCHIVE", dir.join("archive.tar.gz"))
        .env("RUNNER_TEMP", dir.join("temp"))
        .env("GITHUB_PATH", dir.join("path"))
        .output()
        .unwrap();
    let path = fs::read_to_string(dir.join("path")).unwrap();
    let said = [output.stdout, output.stderr].concat();
    (
        output.status.success(),
        path,
        String::from_utf8(said).unwrap(),
    )
}

#[test]
#[cfg(target_os = "linux")]
fn the_action_only_runs_an_archive_with_the_right_checksum() {
    let dir = tempfile::tempdir().unwrap();
    let name = format!("bagreel-{}-unknown-linux-musl", std::env::consts::ARCH);
    let ours = "mkdir $0 && printf '#!/bin/sh\necho hello from $0' > $0/bagreel && chmod +x $0/bagreel && \
        tar -czf archive.tar.gz $0 && sha256sum archive.tar.gz";
    let packed = Command::new("sh")
        .args(["-c", ours, &name])
        .current_dir(&dir)
        .output()
        .unwrap();
    let sum = String::from_utf8(packed.stdout).unwrap();
    let sum = sum.split(' ').next().unwrap();
    let (done, path, said) = set_up(dir.path(), sum);
    assert!(done && said.contains("hello from"), "{said}");
    assert!(
        said.contains(&format!("https://example.org/v0.1.0/{name}.tar.gz")),
        "{said}"
    );
    assert!(path.ends_with(&format!("/temp/bagreel-0.1.0/{name}\n")));
    fs::remove_dir_all(dir.path().join("temp")).unwrap();
    let (done, path, said) = set_up(dir.path(), &"0".repeat(64));
    assert!(!done && path.is_empty(), "{said}");
    assert!(!said.contains("hello from"), "{said}");
    assert!(!dir.path().join("temp/bagreel-0.1.0").join(name).exists());
}

/// All files below a folder.
fn below(folder: &Path) -> Vec<PathBuf> {
    let entries = fs::read_dir(folder).unwrap().map(|e| e.unwrap().path());
    let of = |path: PathBuf| {
        if path.is_dir() {
            below(&path)
        } else {
            vec![path]
        }
    };
    entries.flat_map(of).collect()
}

#[test]
fn the_packed_crate_contains_every_file_that_the_source_includes() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let listed = Command::new(std::env::var_os("CARGO").unwrap())
        .args(["package", "--list", "--allow-dirty", "--offline"])
        .current_dir(root)
        .output()
        .unwrap();
    assert!(
        listed.status.success(),
        "{}",
        String::from_utf8_lossy(&listed.stderr)
    );
    let listed = String::from_utf8(listed.stdout).unwrap();
    let packed: Vec<PathBuf> = listed.lines().map(|line| root.join(line)).collect();
    let mut included = 0;
    for file in below(&root.join("src")) {
        let Ok(text) = fs::read_to_string(&file) else {
            continue;
        };
        for part in text
            .split("include_str!(\"")
            .chain(text.split("include_bytes!(\""))
        {
            let path = file.with_file_name(part.split('"').next().unwrap());
            if path.is_file() && file.extension().is_some_and(|e| e == "rs") && path != file {
                let path = path.canonicalize().unwrap();
                assert!(packed.contains(&path), "{} is not packed", path.display());
                included += 1;
            }
        }
    }
    assert!(included > 15, "{included} files are included");
}
