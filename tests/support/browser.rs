//! Runs the scripts of `tests/browser`, which drive pages in browsers.

use std::ffi::OsStr;
use std::path::Path;
use std::process::Command;

/// Runs a script; fails if it does, and in CI also if Chromium or axe is missing.
pub fn drive<S: AsRef<OsStr>>(script: &str, arguments: impl IntoIterator<Item = S>) {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/browser");
    let driven = Command::new("python3")
        .arg(folder.join(script))
        .args(arguments)
        .output();
    let is_must =
        std::env::var_os("CI").is_some_and(|ci| !ci.is_empty() && ci != "0" && ci != "false");
    let Ok(driven) = driven else {
        assert!(!is_must, "`python3` is not installed");
        println!("skipped: `python3` is not installed");
        return;
    };
    let (out, err) = (
        String::from_utf8_lossy(&driven.stdout),
        String::from_utf8_lossy(&driven.stderr),
    );
    assert!(driven.status.success(), "{out}{err}");
    let mut skipped = out.lines().filter(|line| line.starts_with("skipped: "));
    if is_must {
        assert!(skipped.all(|line| line.contains("firefox")), "{out}");
    } else {
        assert!(
            out.contains("all well") || skipped.next().is_some(),
            "{out}"
        );
    }
    print!("{out}");
}
