//! A bag in an object store, read in parts if its format allows it, otherwise via a local copy.

use std::fs::File;
use std::io::{self, Write as _};
use std::path::Path;

use super::{Opened, Refused};
use crate::bag::input::{BagPlace, HEAD, Medium, public_url_of};
use crate::bag::model::{ETAG, OpenOptions, Reader, Report, Sink};
use crate::bag::source::{FAR, FileSource, Temporary};
use crate::bag::unknown::explain;
use crate::bag::{FORMATS, FormatRow};
use crate::base::budget::UNPACKED_COPY;
use crate::base::error::{Error, Result};
use crate::base::time::Span;
use crate::base::words;

/// A reader of an object, for which a failed request is an error and not damage of the bag.
struct Watched {
    inner: Box<dyn Reader>,
    refused: Refused,
    etag: Option<String>,
    /// The local copy, removed when the bag has been read.
    _copy: Option<Temporary>,
}

/// Opens the bag at `url`.
pub(crate) fn open(url: &str, options: &OpenOptions) -> Result<Box<dyn Reader>> {
    if url.ends_with('/') {
        let what = format!("`{}` is a prefix, not a bag", public_url_of(url));
        return Err(Error::usage(
            what,
            "give one bag; `bagreel tables` counts all of a store",
        ));
    }
    let Opened {
        source,
        etag,
        refused,
    } = super::object(url)?;
    let opened = inner(source, options);
    refused.check()?;
    let (inner, copy) = opened?;
    Ok(Box::new(Watched {
        inner,
        refused,
        etag,
        _copy: copy,
    }))
}

fn inner(
    source: FileSource,
    options: &OpenOptions,
) -> Result<(Box<dyn Reader>, Option<Temporary>)> {
    let path = source.path().to_owned();
    let fail = || Error::io("read", &path);
    let mut head = vec![0; HEAD];
    let got = source.read_at(0, &mut head).map_err(fail())?;
    head.truncate(got);
    let place = BagPlace::File(source);
    let found = FORMATS.iter().find(|f| (f.sniff)(&place, &head));
    let (Some(row), BagPlace::File(source)) = (found, place) else {
        return Err(explain(&path, &head, false));
    };
    if row.medium == Medium::Stream {
        return Ok(((row.open)(BagPlace::File(source), options)?, None));
    }
    let (source, copy) = local(row, &source)?;
    Ok(((row.open)(BagPlace::File(source), options)?, Some(copy)))
}

/// A local copy of an object that cannot be read in parts.
fn local(row: &FormatRow, source: &FileSource) -> Result<(FileSource, Temporary)> {
    let path = source.path();
    if source.len() > UNPACKED_COPY {
        let most = words::bytes(UNPACKED_COPY);
        let name = row.name;
        let what = format!("{name} needs a local copy, and it is larger than {most}");
        return Err(Error::unsupported(path, what, "download the bag"));
    }
    let copy = Temporary::new()?;
    // Its own name, which the reader reports; never a path.
    let name = path.file_name().unwrap_or("bag".as_ref());
    let to = copy.path().join(name);
    download(source, &to).map_err(Error::io("copy", path))?;
    Ok((FileSource::open(&to)?, copy))
}

fn download(source: &FileSource, to: &Path) -> io::Result<()> {
    let mut file = File::create(to)?;
    let mut buffer = vec![0; FAR];
    let mut at = 0;
    loop {
        let got = source.read_at(at, &mut buffer)?;
        if got == 0 {
            return Ok(());
        }
        file.write_all(&buffer[..got])?;
        at += got as u64;
    }
}

impl Reader for Watched {
    fn span(&mut self) -> Result<Option<Span>> {
        let span = self.inner.span();
        self.refused.check()?;
        span
    }

    fn read(&mut self, range: Option<Span>, sink: &mut dyn Sink) -> Result<Report> {
        let report = self.inner.read(range, sink);
        self.refused.check()?;
        let mut report = report?;
        let etag = self.etag.iter().cloned();
        report
            .facts
            .extend(etag.map(|etag| (ETAG.to_owned(), etag)));
        Ok(report)
    }
}
