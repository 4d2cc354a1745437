//! Sources of bytes: files with random access, and streams that support peeking and skipping.

use std::fs::File;
use std::io::{self, Read};
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicU64, Ordering};

use crc32fast::Hasher;

use crate::base::error::{Error, Result};
use crate::base::file::Leftover;

/// A file with random access, shared by several threads. It counts the bytes it reads.
#[derive(Debug)]
pub(crate) struct FileSource {
    path: PathBuf,
    file: File,
    len: u64,
    read: AtomicU64,
}

impl FileSource {
    /// Opens the file at `path` for reading.
    ///
    /// # Errors
    /// An error of the system.
    pub(crate) fn open(path: &Path) -> Result<Self> {
        // Opening a pipe would wait for its writer.
        if !path.metadata().map_err(Error::io("read", path))?.is_file() {
            let error = io::Error::other("it is not a regular file");
            return Err(Error::io("read", path)(error));
        }
        let file = File::open(path).map_err(Error::io("read", path))?;
        let len = file.metadata().map_err(Error::io("read", path))?.len();
        Ok(Self {
            path: path.to_owned(),
            file,
            len,
            read: AtomicU64::new(0),
        })
    }

    /// The path, as it was opened.
    pub(crate) fn path(&self) -> &Path {
        &self.path
    }

    /// The size in bytes when it was opened.
    pub(crate) fn len(&self) -> u64 {
        self.len
    }

    /// The bytes read from it so far.
    pub(crate) fn bytes_read(&self) -> u64 {
        self.read.load(Ordering::Relaxed)
    }

    /// Reads from byte `at` on until `into` is full or the file ends; returns the number of bytes read.
    ///
    /// # Errors
    /// An error of the system.
    pub(crate) fn read_at(&self, at: u64, into: &mut [u8]) -> io::Result<usize> {
        let mut filled = 0;
        while filled < into.len() {
            let next = at + filled as u64;
            match read_once(&self.file, next, &mut into[filled..]) {
                Ok(0) => break,
                Ok(n) => filled += n,
                Err(e) if e.kind() == io::ErrorKind::Interrupted => {}
                Err(e) => return Err(e),
            }
        }
        self.read.fetch_add(filled as u64, Ordering::Relaxed);
        Ok(filled)
    }
}

/// Reads some bytes from `at` on; 0 bytes only at the end.
#[cfg(unix)]
fn read_once(file: &File, at: u64, into: &mut [u8]) -> io::Result<usize> {
    std::os::unix::fs::FileExt::read_at(file, into, at)
}

#[cfg(windows)]
fn read_once(file: &File, at: u64, into: &mut [u8]) -> io::Result<usize> {
    std::os::windows::fs::FileExt::seek_read(file, into, at)
}

/// Reads at a position on systems where threads share the file position: one thread at a time.
#[cfg(not(any(unix, windows)))]
fn read_once(mut file: &File, at: u64, into: &mut [u8]) -> io::Result<usize> {
    use std::io::{Seek as _, SeekFrom};
    static ONE: std::sync::Mutex<()> = std::sync::Mutex::new(());
    let _one = ONE.lock();
    file.seek(SeekFrom::Start(at))?;
    file.read(into)
}

/// A temporary folder, removed on drop.
pub(crate) struct Temporary {
    folder: tempfile::TempDir,
    _left: Leftover,
}

impl Temporary {
    /// Creates one in the system's folder for temporary files.
    ///
    /// # Errors
    /// An error of the system.
    pub(crate) fn new() -> Result<Self> {
        let mut builder = tempfile::Builder::new();
        // The originals may be private.
        #[cfg(unix)]
        builder.permissions(std::os::unix::fs::PermissionsExt::from_mode(0o700));
        let folder = builder.tempdir();
        let folder = folder.map_err(Error::io("create a folder in", &std::env::temp_dir()))?;
        Ok(Self {
            _left: Leftover::at(folder.path()),
            folder,
        })
    }

    /// The path of the folder.
    pub(crate) fn path(&self) -> &Path {
        self.folder.path()
    }
}

enum From<'a> {
    /// Part of a file, up to byte `end`.
    File { source: &'a FileSource, end: u64 },
    /// Any sequential reader.
    Reader(Box<dyn Read + Send + 'a>),
}

/// A sequential stream of bytes with look-ahead; skipping is free in a file.
pub(crate) struct ByteStream<'a> {
    from: From<'a>,
    /// The position of `buffer[used]`.
    at: u64,
    /// Its part `used..filled` has been read ahead. It keeps its length, so that it is not cleared at every step.
    buffer: Vec<u8>,
    used: usize,
    filled: usize,
    /// The number of bytes read at a time.
    step: usize,
    /// The CRC-32 of all bytes taken except `buffer[summed..used]`, if requested.
    sum: Option<Hasher>,
    summed: usize,
}

/// The most bytes of a pipe that are read ahead to find whether a record is whole.
const MOST_AHEAD: usize = 16 << 20;

/// The step for sequential reading.
pub(crate) const FAR: usize = 256 * 1024;
/// The step for picking small records here and there.
pub(crate) const NEAR: usize = 4096;
/// The step for the head of a record alone.
pub(crate) const GLANCE: usize = 512;

impl<'a> ByteStream<'a> {
    /// The bytes `start..end` of a file, `step` at a time.
    pub(crate) fn of_file(source: &'a FileSource, start: u64, end: u64, step: usize) -> Self {
        let end = end.min(source.len());
        Self::new(From::File { source, end }, start, step)
    }

    /// All bytes of `reader`, counted from 0.
    pub(crate) fn of_reader(reader: impl Read + Send + 'a) -> Self {
        Self::new(From::Reader(Box::new(reader)), 0, FAR)
    }

    fn new(from: From<'a>, at: u64, step: usize) -> Self {
        Self {
            from,
            at,
            buffer: Vec::new(),
            used: 0,
            filled: 0,
            step,
            sum: None,
            summed: 0,
        }
    }

    /// Starts a checksum of all bytes taken from here on; skipped bytes of a file are then read too.
    pub(crate) fn sum_up(&mut self) {
        self.sum = Some(Hasher::new());
        self.summed = self.used;
    }

    /// The CRC-32 of all bytes taken since [`ByteStream::sum_up`]; `None` without that.
    pub(crate) fn sum(&mut self) -> Option<u32> {
        self.update_sum();
        self.sum.clone().map(Hasher::finalize)
    }

    /// Adds the bytes taken since the last call, many at once.
    fn update_sum(&mut self) {
        if let Some(sum) = &mut self.sum {
            sum.update(&self.buffer[self.summed..self.used]);
            self.summed = self.used;
        }
    }

    /// The position of the next byte.
    pub(crate) fn position(&self) -> u64 {
        self.at
    }

    /// The next `n` bytes without taking them; fewer only at the end. `n` must be bounded by the caller.
    ///
    /// # Errors
    /// An error of the system, or of a decompressor.
    pub(crate) fn peek(&mut self, n: usize) -> io::Result<&[u8]> {
        if self.ahead() < n {
            self.fill(n)?;
        }
        let end = self.filled.min(self.used + n);
        Ok(&self.buffer[self.used..end])
    }

    /// Whether `len` more bytes follow. Where only reading shows this, more than [`MOST_AHEAD`] are taken to follow if these
    /// do: a damaged length hardly ever is between.
    ///
    /// # Errors
    /// As [`ByteStream::peek`].
    pub(crate) fn has(&mut self, len: u64) -> io::Result<bool> {
        if let Some(left) = self.left() {
            return Ok(left >= len);
        }
        let len = usize::try_from(len).map_or(MOST_AHEAD, |len| len.min(MOST_AHEAD));
        Ok(self.peek(len)?.len() == len)
    }

    /// The number of remaining bytes, if known without reading.
    pub(crate) fn left(&self) -> Option<u64> {
        match self.from {
            From::File { end, .. } => Some(end.saturating_sub(self.at)),
            From::Reader(_) => None,
        }
    }

    /// The number of bytes that have been read ahead and not taken.
    fn ahead(&self) -> usize {
        self.filled - self.used
    }

    /// Reads until `n` bytes are buffered or the stream ends. What is buffered stays where it is as long as there is room, or
    /// many looks ahead near the end would copy it each time.
    fn fill(&mut self, n: usize) -> io::Result<()> {
        self.update_sum();
        let left = self.left().and_then(|left| usize::try_from(left).ok());
        let most = self.step.max(n).min(left.unwrap_or(usize::MAX));
        if self.buffer.len() < self.used + n.min(most) {
            self.buffer.copy_within(self.used..self.filled, 0);
            (self.filled, self.used) = (self.ahead(), 0);
            self.buffer.resize(most.max(self.buffer.len()), 0);
        }
        self.summed = self.used;
        while self.ahead() < n.min(most) {
            let next = self.at + self.ahead() as u64;
            let end = self.buffer.len().min(self.used + most);
            let into = &mut self.buffer[self.filled..end];
            let got = match &mut self.from {
                From::File { source, .. } => source.read_at(next, into)?,
                From::Reader(reader) => read_some(reader, into)?,
            };
            if got == 0 {
                break;
            }
            self.filled += got;
        }
        Ok(())
    }

    /// Goes back to byte `at` of a file.
    pub(crate) fn back(&mut self, at: u64) {
        self.at = at;
        (self.used, self.filled) = (0, 0);
    }

    /// Takes `n` bytes that were peeked at.
    pub(crate) fn advance(&mut self, n: usize) {
        let n = n.min(self.ahead());
        self.used += n;
        self.at += n as u64;
    }

    /// Skips `n` bytes; returns their number, fewer only at the end. At the end of a file the number is right without
    /// reading.
    ///
    /// # Errors
    /// As [`ByteStream::peek`].
    pub(crate) fn skip(&mut self, n: u64) -> io::Result<u64> {
        let mut left = n;
        loop {
            let here = usize::try_from(left)
                .unwrap_or(usize::MAX)
                .min(self.ahead());
            self.advance(here);
            left -= here as u64;
            if left == 0 {
                return Ok(n);
            }
            if let From::File { end, .. } = self.from
                && self.sum.is_none()
            {
                let step = left.min(end.saturating_sub(self.at));
                self.at += step;
                return Ok(n - left + step);
            }
            if self.peek(1)?.is_empty() {
                return Ok(n - left);
            }
        }
    }
}

impl Read for ByteStream<'_> {
    fn read(&mut self, into: &mut [u8]) -> io::Result<usize> {
        if self.ahead() == 0 {
            self.peek(1)?;
        }
        let n = self.ahead().min(into.len());
        into[..n].copy_from_slice(&self.buffer[self.used..self.used + n]);
        self.advance(n);
        Ok(n)
    }
}

/// The CRC-32 of bytes of which `crc` is that of those before `more`.
pub(crate) fn extended(crc: u32, more: &[u8]) -> u32 {
    let mut sum = Hasher::new_with_initial(crc);
    sum.update(more);
    sum.finalize()
}

fn read_some(reader: &mut dyn Read, into: &mut [u8]) -> io::Result<usize> {
    loop {
        match reader.read(into) {
            Err(e) if e.kind() == io::ErrorKind::Interrupted => {}
            other => return other,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    #[cfg(unix)]
    fn temporary_folders_are_private() {
        use std::os::unix::fs::PermissionsExt as _;
        let folder = Temporary::new().unwrap();
        let mode = folder.path().metadata().unwrap().permissions().mode();
        assert_eq!(mode & 0o077, 0, "{mode:o}");
    }

    #[test]
    fn streams_of_files_and_readers_behave_the_same() {
        let bytes: Vec<u8> = (0..=255).cycle().take(10_000).collect();
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("bytes");
        std::fs::write(&path, &bytes).unwrap();
        let source = FileSource::open(&path).unwrap();
        let streams = [
            ByteStream::of_file(&source, 0, u64::MAX, 16),
            ByteStream::of_reader(io::Cursor::new(bytes.clone())),
            ByteStream::of_file(&source, 0, u64::MAX, 16),
        ];
        for (at, mut stream) in streams.into_iter().enumerate() {
            if at > 0 {
                stream.sum_up();
            }
            assert_eq!(stream.peek(4).unwrap(), &bytes[..4]);
            stream.advance(3);
            assert_eq!(stream.skip(5000).unwrap(), 5000);
            assert_eq!(stream.position(), 5003);
            assert_eq!(stream.peek(300).unwrap(), &bytes[5003..5303]);
            assert_eq!(stream.skip(u64::MAX).unwrap(), 4997);
            assert!(stream.peek(1).unwrap().is_empty());
            let sum = (at > 0).then(|| extended(0, &bytes));
            assert_eq!(stream.sum(), sum);
        }
    }
}
