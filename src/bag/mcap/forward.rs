//! An MCAP file record by record from the front: without a summary, cut, unchunked, or from a pipe.

use std::collections::BTreeSet;
use std::io::{self, Read as _};

use super::records::{self, Table, op};
use crate::bag::adapters::Gather;
use crate::bag::decompress::{Allowance, Compression, UNFOLDS};
use crate::bag::index::{hand_over, nameless, pass};
use crate::bag::model::{Sink, Want};
use crate::bag::source::Stream;
use crate::base::notice::{Notice, NoticeKind};

/// What was found on the way.
#[derive(Debug, Default)]
pub(super) struct Found {
    pub(super) compression: BTreeSet<Compression>,
    /// The file has its end, and nothing was skipped.
    pub(super) complete: bool,
}

/// Walks the records of a file.
struct Walk<'s> {
    sink: &'s mut dyn Sink,
    table: Table,
    wants: Vec<Want>,
    gather: Gather,
    found: Found,
    allowance: Allowance,
    total: u64,
}

/// Reads all that `stream` holds from behind the opening magic.
pub(super) fn read(stream: &mut Stream<'_>, total: u64, sink: &mut dyn Sink) -> Found {
    let mut walk = Walk {
        sink,
        table: Table::default(),
        wants: Vec::new(),
        gather: Gather::default(),
        found: Found {
            complete: true,
            ..Found::default()
        },
        allowance: Allowance::default(),
        total,
    };
    let told = walk.outside(stream);
    walk.gather.flush(walk.sink);
    let at = stream.position();
    let (kind, text) = match told {
        Ok(true) => return walk.found,
        Ok(false) => (
            NoticeKind::Truncated,
            format!("the file was never finished; it ends at byte {at}"),
        ),
        Err(e) if e.kind() == io::ErrorKind::UnexpectedEof => (
            NoticeKind::Truncated,
            format!("the file is cut at byte {at}"),
        ),
        Err(e) => (
            NoticeKind::Damaged,
            format!("reading stopped at byte {at}: {e}"),
        ),
    };
    walk.damage(kind, &text);
    walk.found
}

impl Walk<'_> {
    /// The records of the file itself; answers whether the end of the data was met.
    fn outside(&mut self, stream: &mut Stream<'_>) -> io::Result<bool> {
        while let Some((kind, len)) = records::next(stream)? {
            match kind {
                op::CHUNK => self.chunk(stream, len)?,
                // What follows is the summary.
                op::DATA_END | op::FOOTER => return Ok(true),
                // No record is of this kind: zeros where the disk was full.
                0 => {
                    let text = format!(
                        "what stands from byte {} on is no record",
                        stream.position()
                    );
                    self.damage(NoticeKind::Damaged, &text);
                    return Ok(true);
                }
                _ => {
                    if kind == op::MESSAGE {
                        self.found.compression.insert(Compression::None);
                    }
                    self.record(stream, kind, len)?;
                }
            }
            self.sink.progress(stream.position(), self.total);
        }
        Ok(false)
    }

    fn chunk(&mut self, stream: &mut Stream<'_>, len: u64) -> io::Result<()> {
        let end = stream.position().saturating_add(len);
        let Some(head) = records::chunk(stream)?.filter(|h| h.skip <= len) else {
            self.damage(NoticeKind::Damaged, "a chunk has no readable head");
            return pass(stream, len);
        };
        let Some(how) = Compression::named(&head.compression) else {
            self.damage(
                NoticeKind::Damaged,
                "a chunk is compressed in a way that no reader knows",
            );
            return pass(stream, len);
        };
        self.found.compression.insert(how);
        pass(stream, head.skip)?;
        let compressed = head.compressed.min(len - head.skip);
        let told = if how == Compression::None {
            self.inside(stream, stream.position().saturating_add(compressed))
        } else {
            let most = self.allowance.left(end);
            if most == 0 {
                self.damage(NoticeKind::Damaged, UNFOLDS);
                return pass(stream, len - head.skip);
            }
            let packed = stream.by_ref().take(compressed);
            let mut plain = Stream::of_reader(how.reader(packed)?.take(most));
            let told = self.inside(&mut plain, u64::MAX);
            self.allowance.spend(plain.position());
            told
        };
        self.gather.flush(self.sink);
        let left = end.saturating_sub(stream.position());
        // A chunk cut by the end of the file is told once, as the cut.
        pass(stream, left)?;
        if let Err(e) = told {
            self.damage(
                NoticeKind::Damaged,
                &format!("a chunk is damaged inside: {e}"),
            );
        }
        Ok(())
    }

    /// The records of a chunk, up to where `stream` stands at `end`.
    fn inside(&mut self, stream: &mut Stream<'_>, end: u64) -> io::Result<()> {
        while stream.position() < end {
            match records::next(stream)? {
                Some((op::CHUNK, len)) => pass(stream, len)?,
                Some((kind, len)) => self.record(stream, kind, len)?,
                None => break,
            }
        }
        Ok(())
    }

    fn record(&mut self, stream: &mut Stream<'_>, kind: u8, len: u64) -> io::Result<()> {
        match kind {
            op::MESSAGE => return self.message(stream, len),
            op::SCHEMA => {
                if let Some(record) = records::whole(stream, len)? {
                    self.table.schema(record);
                }
            }
            op::CHANNEL => {
                let record = records::whole(stream, len)?;
                if let Some(connection) = record.and_then(|r| self.table.channel(r)) {
                    self.wants.push(self.sink.connection(connection));
                }
            }
            _ => {}
        }
        pass(stream, len)
    }

    fn message(&mut self, stream: &mut Stream<'_>, len: u64) -> io::Result<()> {
        let Some((channel, time, size)) = records::message(stream, len) else {
            pass(stream, len)?;
            self.damage(NoticeKind::Damaged, "a message has no readable head");
            return Ok(());
        };
        let Some(id) = self.table.get(channel) else {
            self.found.complete = false;
            nameless(self.sink, 1);
            return pass(stream, u64::from(size));
        };
        let want = self.wants[id.0 as usize];
        hand_over(stream, (id, time, size), want, self.sink)?;
        self.gather.add(id, time, size, self.sink);
        Ok(())
    }

    fn damage(&mut self, kind: NoticeKind, text: &str) {
        self.found.complete = false;
        self.sink.notice(Notice::new(kind, text));
    }
}
