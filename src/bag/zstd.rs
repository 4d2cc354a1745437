//! Whole bags compressed by Zstandard (`.db3.zstd`, `.mcap.zstd`), streamed or unpacked into a temporary file.

use std::fs::File;
use std::io::{self, Read};
use std::path::Path;
use std::sync::Arc;

use crate::bag::FORMATS;
use crate::bag::decompress::{Allowance, Compression};
use crate::bag::input::{BagPlace, FormatRow, HEAD, explain, file_name};
use crate::bag::model::{OpenOptions, Reader, Report, Sink};
use crate::bag::source::{ByteStream, FileSource, Temporary};
use crate::base::budget::{UNPACKED_COPY, UNPACKED_FOLD};
use crate::base::error::{Error, Result};
use crate::base::time::Span;

/// Compressed bags of any format.
pub(crate) const FORMAT: FormatRow = FormatRow {
    name: "zstd",
    what: "any of these, compressed as a whole",
    extensions: &["db3.zstd", "mcap.zstd"],
    needs_file: false,
    is_inside: |_| false,
    sniff: |_, head| head.starts_with(b"\x28\xb5\x2f\xfd"),
    open,
    follow: None,
};

/// A reader of the bag inside.
struct Unpacked {
    name: String,
    inner: Box<dyn Reader>,
    /// The unpacked file, removed when the bag has been read.
    _copy: Option<Temporary>,
    file_bytes: u64,
}

fn open(place: BagPlace, options: &OpenOptions) -> Result<Box<dyn Reader>> {
    let (name, file_bytes, packed): (String, u64, Box<dyn Read + Send>) = match place {
        BagPlace::File(source) => {
            let path = source.path().to_owned();
            let file = File::open(&path).map_err(Error::io("read", &path))?;
            (
                path.to_string_lossy().into_owned(),
                source.len(),
                Box::new(file),
            )
        }
        BagPlace::Pipe(name, stream) => (name, 0, Box::new(stream)),
        BagPlace::Folder(path) => return Err(explain(&path, &[], true)),
    };
    let path = Path::new(&name);
    let fail = || Error::io("decompress", path);
    let allowance: Arc<Allowance> = Arc::default();
    let plain = allowance.open(Compression::Zstd, packed).map_err(fail())?;
    let mut stream = ByteStream::of_reader(plain);
    let head = stream.peek(HEAD).map_err(fail())?.to_vec();
    let inside = |row: &&FormatRow| {
        row.name != FORMAT.name && (row.sniff)(&BagPlace::Folder(path.into()), &head)
    };
    let Some(row) = FORMATS.iter().find(inside) else {
        return Err(explain(path, &head, false));
    };
    let (place, copy) = if row.needs_file {
        let copy = Temporary::new()?;
        let limit = file_bytes.saturating_mul(UNPACKED_FOLD).max(UNPACKED_COPY);
        let source = unpack(&mut stream, &copy, limit).map_err(fail())?;
        (BagPlace::File(FileSource::open(&source)?), Some(copy))
    } else {
        (BagPlace::Pipe(file_name(path), stream), None)
    };
    let inner = (row.open)(place, options)?;
    Ok(Box::new(Unpacked {
        name: file_name(path),
        inner,
        _copy: copy,
        file_bytes,
    }))
}

/// Writes the content of `stream` into a temporary file.
fn unpack(
    stream: &mut ByteStream<'_>,
    to: &Temporary,
    limit: u64,
) -> io::Result<std::path::PathBuf> {
    let path = to.path().join("unpacked");
    let mut file = File::create(&path)?;
    let most = limit.saturating_add(1);
    if io::copy(&mut stream.take(most), &mut file)? > limit {
        return Err(io::Error::other(
            "it decompresses to more than a thousand times its size",
        ));
    }
    Ok(path)
}

impl Reader for Unpacked {
    fn is_straight(&self) -> bool {
        self.inner.is_straight()
    }

    fn stated(&self) -> Option<Span> {
        self.inner.stated()
    }

    fn span(&mut self) -> Result<Option<Span>> {
        self.inner.span()
    }

    fn read(&mut self, range: Option<Span>, sink: &mut dyn Sink) -> Result<Report> {
        let report = self.inner.read(range, sink)?;
        Ok(Report {
            name: self.name.clone(),
            compression: vec![Compression::Zstd.word().to_owned()],
            file_bytes: self.file_bytes,
            ..report
        })
    }
}
