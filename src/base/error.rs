//! The one error type: what stopped us, with the path, the value, and the way out.

use std::fmt;
use std::io;
use std::path::{Path, PathBuf};

/// What stopped us. `Display` is one sentence without a period; [`Error::hint`] is the way out, printed after it.
#[derive(Debug)]
#[non_exhaustive]
pub enum Error {
    /// The system refused to read or write `path`.
    Io {
        /// The file or folder.
        path: PathBuf,
        /// What was tried, such as `read` or `write`.
        doing: &'static str,
        /// What the system said.
        source: io::Error,
    },
    /// A store or a server refused to give an object, or could not be reached: nothing is wrong with the bag, and what
    /// was read of it does not count.
    Remote {
        /// The object.
        url: String,
        /// What the store said.
        reason: String,
        /// What to do.
        hint: String,
    },
    /// `path` is no bag that we know.
    UnknownBag {
        /// The file or folder.
        path: PathBuf,
        /// What it is instead, if that can be told: `empty`, `a git-LFS pointer`, …
        looks_like: String,
        /// What to do.
        hint: String,
    },
    /// A bag breaks its format in a way that leaves nothing to read.
    Malformed {
        /// The bag.
        path: PathBuf,
        /// Where, in bytes from the file's start.
        offset: u64,
        /// What should stand there.
        expected: String,
        /// What to do.
        hint: String,
    },
    /// A bag of a kind that we know and cannot read.
    Unsupported {
        /// The bag.
        path: PathBuf,
        /// What about it.
        what: String,
        /// What to do.
        hint: String,
    },
    /// A bag, or the part of it that was asked for, holds no message.
    NoMessages {
        /// The bag.
        path: PathBuf,
        /// What to do.
        hint: String,
    },
    /// A file of the user's (style, topology, expectation) that says something wrong.
    BadFile {
        /// The file.
        path: PathBuf,
        /// The line, 1..; 0 where none can be named.
        line: usize,
        /// What is wrong.
        reason: String,
        /// What to do.
        hint: String,
    },
    /// An expectation that says something wrong.
    BadExpectation {
        /// The file.
        path: PathBuf,
        /// The line, 1..; 0 where none can be named.
        line: usize,
        /// The character in it, 1...
        column: usize,
        /// What is wrong.
        reason: String,
        /// What to do.
        hint: String,
    },
    /// A value that was asked for and makes no sense. Exit code 2.
    Usage {
        /// What is wrong, with the value.
        what: String,
        /// What to do.
        hint: String,
    },
    /// The user broke off.
    Interrupted,
    /// Something could not be drawn or written.
    Output {
        /// The file that was to be written, or what was to be made.
        path: PathBuf,
        /// What is wrong.
        reason: String,
        /// What to do.
        hint: String,
    },
}

/// What every fallible function of this crate returns.
pub type Result<T, E = Error> = std::result::Result<T, E>;

impl Error {
    /// The system's refusal on `path`, for use in `map_err`.
    pub fn io(doing: &'static str, path: &Path) -> impl FnOnce(io::Error) -> Self + use<> {
        let path = path.to_owned();
        move |source| Self::Io {
            path,
            doing,
            source,
        }
    }

    /// A value that makes no sense.
    pub fn usage(what: impl Into<String>, hint: impl Into<String>) -> Self {
        Self::Usage {
            what: what.into(),
            hint: hint.into(),
        }
    }

    /// What the user can do; empty where nothing helps.
    pub fn hint(&self) -> String {
        match self {
            Self::Io { source, .. } => io_hint(source).to_owned(),
            Self::Interrupted => String::new(),
            Self::Remote { hint, .. }
            | Self::UnknownBag { hint, .. }
            | Self::Malformed { hint, .. }
            | Self::Unsupported { hint, .. }
            | Self::NoMessages { hint, .. }
            | Self::BadFile { hint, .. }
            | Self::BadExpectation { hint, .. }
            | Self::Usage { hint, .. }
            | Self::Output { hint, .. } => hint.clone(),
        }
    }

    /// Whether the command line was at fault (exit code 2) rather than the data (1).
    pub fn is_usage(&self) -> bool {
        matches!(self, Self::Usage { .. })
    }
}

fn io_hint(source: &io::Error) -> &'static str {
    match source.kind() {
        io::ErrorKind::NotFound => "check the spelling of the path",
        io::ErrorKind::PermissionDenied => "check who may read or write it",
        io::ErrorKind::StorageFull => "make room or write elsewhere with `-o`",
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
            } => write!(f, "cannot {doing} `{}`: {source}", path.display()),
            Self::Remote { url, reason, .. } => write!(f, "cannot read `{url}`: {reason}"),
            Self::UnknownBag {
                path, looks_like, ..
            } => write!(f, "`{}` is no bag: it is {looks_like}", path.display()),
            Self::Malformed {
                path,
                offset,
                expected,
                ..
            } => write!(
                f,
                "`{}` is malformed at byte {offset}: expected {expected}",
                path.display()
            ),
            Self::Unsupported { path, what, .. } => {
                write!(f, "`{}` cannot be read: {what}", path.display())
            }
            Self::NoMessages { path, .. } => write!(f, "`{}` holds no messages", path.display()),
            Self::BadFile {
                path, line, reason, ..
            } => match line {
                0 => write!(f, "`{}`: {reason}", path.display()),
                _ => write!(f, "`{}` line {line}: {reason}", path.display()),
            },
            Self::BadExpectation {
                path,
                line,
                column,
                reason,
                ..
            } => match line {
                0 => write!(f, "`{}`: {reason}", path.display()),
                _ => write!(
                    f,
                    "`{}` line {line}, column {column}: {reason}",
                    path.display()
                ),
            },
            Self::Usage { what, .. } => f.write_str(what),
            Self::Interrupted => f.write_str("interrupted; unfinished outputs were removed"),
            Self::Output { path, reason, .. } => {
                write!(f, "cannot write `{}`: {reason}", path.display())
            }
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
