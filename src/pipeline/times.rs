//! The times of all messages per connection, from the index, without payloads; they spill to an unnamed file if necessary.

use std::collections::BTreeSet;
use std::path::Path;
use std::sync::Arc;

use super::Watch;
use crate::bag::{Connection, ConnectionId, Reader, Report, Sink, Want};
use crate::base::error::{Error, Result};
use crate::base::ids::ById;
use crate::base::name::{NodeName, TopicName};
use crate::base::notice::{Notice, NoticeKind, Notices};
use crate::base::time::{Span, Stamp};
use crate::evidence::clock;
use crate::evidence::times::{SeriesId, Stamps, Timed};
use crate::view::NameFilter;

/// A publisher of a topic with a type, or the unnamed ones.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(super) struct Sender {
    pub(super) topic: TopicName,
    pub(super) type_name: Arc<str>,
    pub(super) node: Option<Arc<str>>,
}

/// The times of the messages of some topics, over several bags.
pub(super) struct MessageTimes<'a> {
    filter: &'a NameFilter,
    /// What is wanted of these topics: their times alone, or sizes too.
    want: Want,
    pub(super) stamps: Stamps,
    /// Two per connection: messages of known size, and the others.
    pub(super) series: Vec<SeriesId>,
    /// The sender of each series.
    pub(super) senders: Vec<Sender>,
    pub(super) notices: Notices,
    /// All topics of the bags.
    pub(super) topics: BTreeSet<TopicName>,
    /// The number of bags read.
    bags: usize,
}

impl<'a> MessageTimes<'a> {
    pub(super) fn new(filter: &'a NameFilter, want: Want) -> Self {
        Self {
            filter,
            want,
            stamps: Stamps::default(),
            series: Vec::new(),
            senders: Vec::new(),
            notices: Notices::default(),
            topics: BTreeSet::new(),
            bags: 0,
        }
    }

    /// Adds a bag, or the part of it in `range`.
    pub(super) fn read(
        &mut self,
        reader: &mut dyn Reader,
        range: Option<Span>,
        watch: &mut dyn Watch,
    ) -> Result<Report> {
        let mut one = OfBag {
            series: Vec::new(),
            all: self,
            watch,
        };
        let report = reader.read(range, &mut one)?;
        self.bags += 1;
        self.notices.extend(of_report(&report, &self.notices));
        Ok(report)
    }

    /// Sets the messages at incredible times aside, after the last bag; returns what is said of them. Each bag is judged alone,
    /// since messages of several years may be in one table.
    pub(super) fn finish(&mut self) -> Result<Vec<Notice>> {
        self.stamps.finish().map_err(spool)?;
        let mut said = Vec::new();
        for (bag, calendar) in self.stamps.calendars().clone().with_ids() {
            let alone = ById::from(vec![calendar.clone()]);
            let Some(span) = clock::believed(&alone).span else {
                continue;
            };
            let of_bag = |id: &&SeriesId| self.stamps.bag_of(**id) == bag;
            let own: Vec<SeriesId> = self.series.iter().filter(of_bag).copied().collect();
            let clips = own.into_iter().map(|id| self.stamps.clip(id, span));
            let aside = clips.sum::<std::io::Result<u64>>().map_err(spool)?;
            said.extend(clock::set_aside(&alone, span, aside));
        }
        Ok(said)
    }

    /// The time that the messages cover.
    pub(super) fn span(&self) -> Option<Span> {
        let bounds = self.series.iter().filter_map(|id| self.stamps.bounds(*id));
        let spans = bounds.map(|(first, last)| Span::new(first, last.plus(1)));
        spans.reduce(|all, span| all.hull(span))
    }

    /// Passes on the messages of these series sorted by time, then by series.
    pub(super) fn merge(&self, series: &[SeriesId], each: impl FnMut(Timed)) -> Result<()> {
        self.stamps.merge(series, each).map_err(spool)
    }
}

fn spool(error: std::io::Error) -> Error {
    Error::io("read", Path::new("temporary file of times"))(error)
}

/// The sink for one bag.
struct OfBag<'a, 'b> {
    all: &'a mut MessageTimes<'b>,
    /// The series of each of its connections: messages of known size, and the others.
    series: Vec<Option<[SeriesId; 2]>>,
    watch: &'a mut dyn Watch,
}

impl Sink for OfBag<'_, '_> {
    fn connection(&mut self, connection: &Connection) -> Want {
        let all = &mut *self.all;
        let is_wanted = all.filter.passes(connection.topic.as_str());
        all.topics.insert(connection.topic.clone());
        self.series.push(is_wanted.then(|| {
            let series = [(); 2].map(|()| all.stamps.series_of(all.bags));
            all.series.extend(series);
            all.senders.extend(series.map(|_| Sender {
                topic: connection.topic.clone(),
                type_name: Arc::clone(&connection.type_name),
                node: connection.publisher.as_ref().map(NodeName::shared),
            }));
            series
        }));
        if is_wanted { all.want } else { Want::Stamps }
    }

    fn stamps(&mut self, connection: ConnectionId, stamps: &[Stamp], sizes: Option<&[u32]>) {
        let series = self.series.get(connection.0 as usize);
        if let Some(Some([sized, sizeless])) = series {
            let series = if sizes.is_some() { *sized } else { *sizeless };
            self.all.stamps.add(series, stamps, sizes);
        }
    }

    fn notice(&mut self, notice: Notice) {
        self.all.notices.add(notice);
    }

    fn progress(&mut self, done: u64, total: u64) {
        self.watch.progress(done, total);
    }
}

/// The notice about losses of a bag that reported none.
pub(super) fn of_report(report: &Report, notices: &Notices) -> Option<Notice> {
    let silent = !report.complete && !notices.any_loss();
    let text = format!("`{}` is not complete", report.name);
    silent.then(|| Notice::new(NoticeKind::Damaged, text))
}
