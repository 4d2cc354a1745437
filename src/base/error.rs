//! The error type of the crate: the cause, with the path, the value, and advice.

use std::fmt;
use std::io;
use std::path::{Path, PathBuf};

use super::nearest::nearest;

/// The reason why a command failed. `Display` is one sentence without a period; [`Error::hint`] is advice printed
/// after it.
#[derive(Debug)]
#[non_exhaustive]
pub enum Error {
    /// The system refused to read or write `path`.
    Io {
        /// The file or folder.
        path: PathBuf,
        /// The action that was tried, such as `read` or `write`.
        doing: &'static str,
        /// The system's error.
        source: io::Error,
    },
    /// A file or folder that is not a bag of a known format.
    UnknownBag(Fault),
    /// A bag that breaks its format in a way that leaves nothing to read.
    Malformed {
        /// The bag.
        path: PathBuf,
        /// The expected content.
        expected: String,
        /// Advice for the user.
        hint: String,
    },
    /// A bag of a known kind that cannot be read.
    Unsupported(Fault),
    /// A bag, or the requested part of it, that contains no message.
    NoMessages(Fault),
    /// A file of the user's (style, topology, expectation) with a mistake in it.
    BadFile(Fault),
    /// An invalid request. Exit code 2.
    Usage(Fault),
    /// The user interrupted the command.
    Interrupted,
    /// Something could not be drawn or written.
    Output(Fault),
}

/// What is wrong, and what to do about it.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Fault {
    /// One sentence without a period, with the file or the value.
    pub what: String,
    /// Advice for the user; empty for none.
    pub hint: String,
}

impl Fault {
    fn new(what: impl Into<String>, hint: impl Into<String>) -> Self {
        Self {
            what: what.into(),
            hint: hint.into(),
        }
    }
}

/// The result of every fallible function of this crate.
pub type Result<T, E = Error> = std::result::Result<T, E>;

impl Error {
    /// An [`Error::Io`] on `path` by the system's error, for use in `map_err`.
    pub fn io(doing: &'static str, path: &Path) -> impl FnOnce(io::Error) -> Self + use<> {
        let path = path.to_owned();
        move |source| Self::Io {
            path,
            doing,
            source,
        }
    }

    /// An [`Error::Usage`] for an invalid value.
    pub fn usage(what: impl Into<String>, hint: impl Into<String>) -> Self {
        Self::Usage(Fault::new(what, hint))
    }

    /// The error for a file or folder that is something else than a bag: `empty`, `a git-LFS pointer`, …
    pub(crate) fn unknown_bag(path: &Path, looks_like: &str, hint: impl Into<String>) -> Self {
        let what = format!("`{}` is not a bag: it is {looks_like}", path.display());
        Self::UnknownBag(Fault::new(what, hint))
    }

    /// The error for a mistake in a line of a file of the user's; 0 if the line is unknown.
    pub fn bad_file(
        path: &Path,
        line: usize,
        reason: impl Into<String>,
        hint: impl Into<String>,
    ) -> Self {
        Self::bad_place(path, [line, 0], &reason.into(), hint)
    }

    /// As [`Error::bad_file`], at a line and a character in it, both 0 if unknown.
    pub(crate) fn bad_place(
        path: &Path,
        at: [usize; 2],
        reason: &str,
        hint: impl Into<String>,
    ) -> Self {
        let place = match at {
            [0, _] => String::new(),
            [line, 0] => format!(" line {line}"),
            [line, column] => format!(" line {line}, column {column}"),
        };
        let what = format!("`{}`{place}: {reason}", path.display());
        Self::BadFile(Fault::new(what, hint))
    }

    /// The error for a bag that cannot be read.
    pub(crate) fn unsupported(
        path: impl Into<PathBuf>,
        what: impl fmt::Display,
        hint: impl Into<String>,
    ) -> Self {
        let what = format!("`{}` cannot be read: {what}", path.into().display());
        Self::Unsupported(Fault::new(what, hint))
    }

    /// The error for a bag without messages.
    pub(crate) fn no_messages(name: &str, hint: impl Into<String>) -> Self {
        let what = format!("`{name}` contains no messages");
        Self::NoMessages(Fault::new(what, hint))
    }

    /// The error for something that could not be drawn or written.
    #[cfg(feature = "render")]
    pub(crate) fn output(path: &Path, reason: impl fmt::Display, hint: impl Into<String>) -> Self {
        let what = format!("cannot write `{}`: {reason}", path.display());
        Self::Output(Fault::new(what, hint))
    }

    /// What is wrong, if it is not an error of the system.
    fn fault(&self) -> Option<&Fault> {
        match self {
            Self::UnknownBag(fault)
            | Self::Unsupported(fault)
            | Self::NoMessages(fault)
            | Self::BadFile(fault)
            | Self::Usage(fault)
            | Self::Output(fault) => Some(fault),
            Self::Io { .. } | Self::Malformed { .. } | Self::Interrupted => None,
        }
    }

    /// Advice for the user; empty if there is none.
    pub fn hint(&self) -> String {
        match self {
            Self::Io { source, path, .. } => match misspelled(source, path) {
                Some(near) => format!("did you mean `{near}`?"),
                None => io_hint(source).to_owned(),
            },
            Self::Malformed { hint, .. } => hint.clone(),
            other => other.fault().map_or("", |fault| &fault.hint).to_owned(),
        }
    }

    /// Whether the command line was at fault (exit code 2) rather than the data (1).
    pub fn is_usage(&self) -> bool {
        matches!(self, Self::Usage(_))
    }
}

/// The file beside a missing one whose name is nearest to its.
fn misspelled(source: &io::Error, path: &Path) -> Option<String> {
    let is_missing = source.kind() == io::ErrorKind::NotFound;
    let name = path.file_name().filter(|_| is_missing)?;
    let folder = path.parent();
    let folder = folder.filter(|folder| !folder.as_os_str().is_empty());
    let files = folder.unwrap_or(Path::new(".")).read_dir().ok()?.flatten();
    let names = files.map(|file| file.file_name().display().to_string());
    let names: Vec<String> = names.collect();
    let near = nearest(&name.to_string_lossy(), names.iter().map(String::as_str))?;
    Some(path.with_file_name(near).display().to_string())
}

fn io_hint(source: &io::Error) -> &'static str {
    match source.kind() {
        io::ErrorKind::NotFound => "check the spelling of the path",
        io::ErrorKind::PermissionDenied => "check its permissions",
        io::ErrorKind::StorageFull => "free some space or write elsewhere with `-o`",
        _ => "",
    }
}

impl fmt::Display for Error {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Io {
                path,
                doing,
                source,
            } => {
                let why = source.to_string();
                // Temporary files add their own path, which nobody gave.
                let why = why.split(" at path ").next().unwrap_or_default();
                write!(f, "cannot {doing} `{}`: {why}", path.display())
            }
            Self::Malformed { path, expected, .. } => write!(
                f,
                "`{}` is malformed at byte 0: expected {expected}",
                path.display()
            ),
            Self::Interrupted => f.write_str("interrupted; unfinished outputs were removed"),
            other => f.write_str(other.fault().map_or("", |fault| &fault.what)),
        }
    }
}

impl std::error::Error for Error {
    fn source(&self) -> Option<&(dyn std::error::Error + 'static)> {
        match self {
            Self::Io { source, .. } => Some(source),
            _ => None,
        }
    }
}
