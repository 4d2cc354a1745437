//! The error type of the crate: the cause, with the path, the value, and advice.

use std::fmt;
use std::io;
use std::path::{Path, PathBuf};

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
    /// `path` is not a bag of a known format.
    UnknownBag {
        /// The file or folder.
        path: PathBuf,
        /// What the file is instead, if known: `empty`, `a git-LFS pointer`, …
        looks_like: String,
        /// Advice for the user.
        hint: String,
    },
    /// A bag breaks its format in a way that leaves nothing to read.
    Malformed {
        /// The bag.
        path: PathBuf,
        /// The place of the damage, in bytes from the file's start.
        offset: u64,
        /// The expected content.
        expected: String,
        /// Advice for the user.
        hint: String,
    },
    /// A bag of a known kind that cannot be read.
    Unsupported {
        /// The bag.
        path: PathBuf,
        /// The reason why it cannot be read.
        what: String,
        /// Advice for the user.
        hint: String,
    },
    /// A bag, or the requested part of it, contains no message.
    NoMessages {
        /// The bag.
        path: PathBuf,
        /// Advice for the user.
        hint: String,
    },
    /// A file of the user's (style, topology, expectation) with a mistake in it.
    BadFile {
        /// The file.
        path: PathBuf,
        /// The line, ≥ 1; 0 if unknown.
        line: usize,
        /// The character in the line, ≥ 1; 0 if unknown.
        column: usize,
        /// The mistake.
        reason: String,
        /// Advice for the user.
        hint: String,
    },
    /// An invalid request. Exit code 2.
    Usage {
        /// The mistake, with the value.
        what: String,
        /// Advice for the user.
        hint: String,
    },
    /// The user interrupted the command.
    Interrupted,
    /// Something could not be drawn or written.
    Output {
        /// The file that was to be written.
        path: PathBuf,
        /// The reason for the failure.
        reason: String,
        /// Advice for the user.
        hint: String,
    },
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
        Self::Usage {
            what: what.into(),
            hint: hint.into(),
        }
    }

    /// The error for a mistake in a line of a file of the user's; 0 if the line is unknown.
    pub fn bad_file(
        path: &Path,
        line: usize,
        reason: impl Into<String>,
        hint: impl Into<String>,
    ) -> Self {
        Self::BadFile {
            path: path.to_owned(),
            line,
            column: 0,
            reason: reason.into(),
            hint: hint.into(),
        }
    }

    /// The error for a bag that cannot be read.
    pub(crate) fn unsupported(
        path: impl Into<PathBuf>,
        what: impl Into<String>,
        hint: impl Into<String>,
    ) -> Self {
        Self::Unsupported {
            path: path.into(),
            what: what.into(),
            hint: hint.into(),
        }
    }

    /// The error for something that could not be drawn or written.
    #[cfg(feature = "render")]
    pub(crate) fn output(path: &Path, reason: impl Into<String>, hint: impl Into<String>) -> Self {
        Self::Output {
            path: path.to_owned(),
            reason: reason.into(),
            hint: hint.into(),
        }
    }

    /// Advice for the user; empty if there is none.
    pub fn hint(&self) -> String {
        match self {
            Self::Io { source, .. } => io_hint(source).to_owned(),
            Self::Interrupted => String::new(),
            Self::UnknownBag { hint, .. }
            | Self::Malformed { hint, .. }
            | Self::Unsupported { hint, .. }
            | Self::NoMessages { hint, .. }
            | Self::BadFile { hint, .. }
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
            } => write!(f, "cannot {doing} `{}`: {source}", path.display()),
            Self::UnknownBag {
                path, looks_like, ..
            } => write!(f, "`{}` is not a bag: it is {looks_like}", path.display()),
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
            Self::NoMessages { path, .. } => write!(f, "`{}` contains no messages", path.display()),
            Self::BadFile {
                path,
                line,
                column,
                reason,
                ..
            } => {
                write!(f, "`{}`", path.display())?;
                match (line, column) {
                    (0, _) => {}
                    (_, 0) => write!(f, " line {line}")?,
                    _ => write!(f, " line {line}, column {column}")?,
                }
                write!(f, ": {reason}")
            }
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
