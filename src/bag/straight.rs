//! Bags whose recorder's clock was set back, or whose simulation restarted: such a bag contains several runs, one
//! after the other in the file, whose times overlap.
//!
//! The first reading detects where time goes back, in file order; if it does, a second reading shifts each run to
//! after the previous one.

use crate::bag::model::{ConnectionId, Message, Sink};
use crate::base::ids::ById;
use crate::base::rhythm::{OUT_OF_ORDER_NS, RUN_FEWEST, RUN_SHARE};
use crate::base::time::Stamp;

/// The longest step back that begins a run: a longer one means that the clock was not set yet.
const LONGEST_NS: i64 = 365 * 86_400_000_000_000;

/// The point in a bag at which a new run begins.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub(crate) struct Seam {
    /// The last time of the previous run and the first of this run, as recorded.
    pub(crate) before: Stamp,
    pub(crate) after: Stamp,
    /// The number of messages before it; 0 for connections that are described after it.
    counts: ById<ConnectionId, u64>,
}

/// The state of a connection.
#[derive(Clone, Debug, Default)]
struct Line {
    count: u64,
    /// The number of messages before the current part of the file.
    before_part: u64,
    /// The last time in this run, and in the possible new run.
    last: Option<Stamp>,
    next: Option<Stamp>,
    /// Whether its time went back where that run may have begun; `None` if that is not known.
    fell: Option<bool>,
}

/// A run that may have begun.
#[derive(Default)]
struct Suspect {
    seam: Seam,
    /// The numbers of connections whose time went back, and of those whose time continued.
    fell: u64,
    went_on: u64,
    messages: u64,
    /// Whether time has passed the point from which it went back.
    is_past: bool,
    /// Whether the part of the file is not over in which it began.
    is_in_part: bool,
}

/// A sink that detects seams.
pub(crate) struct Watched<'a> {
    sink: &'a mut dyn Sink,
    lines: ById<ConnectionId, Line>,
    touched: Vec<ConnectionId>,
    last: Stamp,
    suspect: Option<Suspect>,
    seams: Vec<Seam>,
}

impl<'a> Watched<'a> {
    pub(crate) fn new(sink: &'a mut dyn Sink) -> Self {
        Self {
            sink,
            lines: ById::default(),
            touched: Vec::new(),
            last: Stamp::MIN,
            suspect: None,
            seams: Vec::new(),
        }
    }

    /// The seams of the bag, in file order.
    pub(crate) fn seams(mut self) -> Vec<Seam> {
        self.decide(true);
        self.seams
    }

    fn watch(&mut self, at: ConnectionId, time: Stamp) {
        let line = self.lines.grown(at);
        if let Some(suspect) = &mut self.suspect {
            suspect.messages += 1;
            let latest = line.last.max(line.next);
            let falls = latest.is_some_and(|latest| latest.since(time) > OUT_OF_ORDER_NS);
            if suspect.is_in_part && line.next.is_some() && falls && line.fell != Some(true) {
                // An index lists one connection after the other: those before were still of the previous run.
                suspect.went_on -= u64::from(line.fell == Some(false));
                suspect.fell += 1;
                suspect.is_past = false;
                *suspect.seam.counts.grown(at) = line.count;
                suspect.seam.before = suspect.seam.before.max(latest.unwrap_or(Stamp::MIN));
                (line.last, line.next, line.fell) = (latest, None, Some(true));
            } else if let (Some(last), None) = (line.last, line.next) {
                // Connections that were silent recently may continue after the step as if nothing had
                // happened.
                let would_fall = last.since(suspect.seam.after) > OUT_OF_ORDER_NS;
                let fell = last.since(time) > OUT_OF_ORDER_NS;
                // A rare one may have had a message just before the step.
                line.fell = (would_fall && (fell || last <= time)).then_some(fell);
                suspect.fell += u64::from(line.fell == Some(true));
                suspect.went_on += u64::from(line.fell == Some(false));
            }
            let is_behind = !suspect.is_in_part || line.fell == Some(true);
            if is_behind && suspect.seam.after.since(time) <= OUT_OF_ORDER_NS {
                suspect.seam.after = suspect.seam.after.min(time);
            }
            line.next = Some(line.next.map_or(time, |next| next.max(time)));
            suspect.is_past |= time >= suspect.seam.before;
            return;
        }
        let fall = line.last.map_or(0, |last| last.since(time));
        if fall > OUT_OF_ORDER_NS && fall < LONGEST_NS {
            let own = line.count;
            let mut counts: ById<_, _> = self.lines.iter().map(|line| line.before_part).collect();
            counts[at] = own;
            let seam = Seam {
                before: self.last,
                after: time,
                counts,
            };
            self.suspect = Some(Suspect {
                seam,
                is_in_part: true,
                ..Suspect::default()
            });
            return self.watch(at, time);
        }
        line.last = Some(line.last.map_or(time, |last| last.max(time)));
        self.last = self.last.max(time);
    }

    /// Decides whether a run has begun, once enough of it is known: of the connections that publish again, most have
    /// gone back in time, and not only one of several.
    fn decide(&mut self, is_end: bool) {
        let active = self.lines.iter().filter(|line| line.last.is_some()).count();
        let fewest = active.min(2) as u64;
        let is_known = |s: &mut Suspect| is_end || s.is_past && s.fell + s.went_on >= fewest;
        let Some(suspect) = self.suspect.take_if(is_known) else {
            return;
        };
        let all = suspect.fell + suspect.went_on;
        let most = suspect.fell * 100 >= all * RUN_SHARE && suspect.fell >= fewest;
        let is_run = most && suspect.messages >= RUN_FEWEST;
        for line in self.lines.iter_mut() {
            let next = line.next.take();
            line.fell = None;
            line.last = if is_run { next } else { line.last.max(next) };
        }
        let lasts = self.lines.iter().filter_map(|line| line.last);
        self.last = lasts.max().unwrap_or(self.last);
        self.seams.extend(is_run.then_some(suspect.seam));
    }
}

impl Sink for Watched<'_> {
    fn behind(&mut self) -> Option<&mut dyn Sink> {
        Some(&mut *self.sink)
    }

    fn part(&mut self) {
        self.decide(false);
        if let Some(suspect) = &mut self.suspect {
            suspect.is_in_part = false;
        }
        for at in self.touched.drain(..) {
            let line = self.lines.grown(at);
            line.before_part = line.count;
        }
        self.sink.part();
    }

    fn stamps(&mut self, connection: ConnectionId, stamps: &[Stamp], sizes: Option<&[u32]>) {
        self.touched.push(connection);
        for time in stamps {
            self.watch(connection, *time);
            self.lines.grown(connection).count += 1;
        }
        self.sink.stamps(connection, stamps, sizes);
    }
}

/// A point at which a recorder's clock was set back.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) struct ClockFall {
    /// The last time of the previous run.
    pub(crate) time: Stamp,
    /// How far the clock went back, in nanoseconds.
    pub(crate) length: i64,
}

/// A sink that shifts each run of a bag: to after the previous one.
pub(crate) struct Straightened<'a> {
    sink: &'a mut dyn Sink,
    seams: &'a [Seam],
    /// The shift of each run in nanoseconds; 0 for the first, unless the whole bag is shifted.
    shifts: Vec<i64>,
    /// The number of stamps and of messages per connection so far.
    counts: ById<ConnectionId, [u64; 2]>,
}

/// The shifts of all runs; 0 for the first.
fn shifts(seams: &[Seam]) -> Vec<i64> {
    let mut shifts = vec![0_i64];
    for seam in seams {
        let before = shifts[shifts.len() - 1];
        // The next nanosecond: the real time between the runs is unknown.
        let back = seam.before.since(seam.after).saturating_add(1);
        shifts.push(before.saturating_add(back));
    }
    shifts
}

/// The positions of seams on the time axis: without overlaps, if the runs were moved.
pub(crate) fn falls(seams: &[Seam], is_moved: bool) -> impl Iterator<Item = ClockFall> + '_ {
    let fall = move |(seam, shift): (&Seam, i64)| ClockFall {
        time: seam.before.plus(if is_moved { shift } else { 0 }),
        length: seam.before.since(seam.after),
    };
    seams.iter().zip(shifts(seams)).map(fall)
}

impl<'a> Straightened<'a> {
    pub(crate) fn new(seams: &'a [Seam], sink: &'a mut dyn Sink) -> Self {
        Self {
            sink,
            seams,
            shifts: shifts(seams),
            counts: ById::default(),
        }
    }

    /// One that shifts the only run of a bag by as many nanoseconds.
    pub(crate) fn by(nanos: i64, sink: &'a mut dyn Sink) -> Self {
        Self {
            shifts: vec![nanos],
            ..Self::new(&[], sink)
        }
    }

    /// The shifted time of a connection's next stamp or message.
    fn moved(&mut self, connection: ConnectionId, kind: usize, time: Stamp) -> Stamp {
        let next = &mut self.counts.grown(connection)[kind];
        let count = *next;
        *next += 1;
        let behind = |seam: &Seam| {
            seam.counts
                .get(connection)
                .is_none_or(|before| *before <= count)
        };
        time.plus(self.shifts[self.seams.partition_point(behind)])
    }
}

impl Sink for Straightened<'_> {
    fn behind(&mut self) -> Option<&mut dyn Sink> {
        Some(&mut *self.sink)
    }

    fn stamps(&mut self, connection: ConnectionId, stamps: &[Stamp], sizes: Option<&[u32]>) {
        if self.shifts == [0] {
            return self.sink.stamps(connection, stamps, sizes);
        }
        let moved = stamps.iter().map(|time| self.moved(connection, 0, *time));
        let moved: Vec<Stamp> = moved.collect();
        self.sink.stamps(connection, &moved, sizes);
    }

    fn message(&mut self, message: Message<'_>) {
        if self.shifts == [0] {
            return self.sink.message(message);
        }
        let time = self.moved(message.connection, 1, message.time);
        self.sink.message(Message { time, ..message });
    }
}

/// Passes the stamps that are kept on, with their sizes; returns the number of the others.
pub(crate) fn pass(
    sink: &mut dyn Sink,
    connection: ConnectionId,
    stamps: &[Option<Stamp>],
    sizes: Option<&[u32]>,
) -> u64 {
    let kept: Vec<Stamp> = stamps.iter().copied().flatten().collect();
    let sizes = sizes.map(|sizes| {
        let kept = sizes.iter().zip(stamps).filter(|(_, kept)| kept.is_some());
        kept.map(|(size, _)| *size).collect::<Vec<u32>>()
    });
    if !kept.is_empty() {
        sink.stamps(connection, &kept, sizes.as_deref());
    }
    (stamps.len() - kept.len()) as u64
}

#[cfg(test)]
mod tests {
    use super::*;

    const SECOND: i64 = 1_000_000_000;

    /// A sink that collects the stamps of each connection, in seconds.
    #[derive(Default)]
    struct Kept(Vec<Vec<i64>>);

    impl Sink for Kept {
        fn stamps(&mut self, connection: ConnectionId, stamps: &[Stamp], _: Option<&[u32]>) {
            let at = connection.0 as usize;
            self.0.resize(self.0.len().max(at + 1), Vec::new());
            self.0[at].extend(stamps.iter().map(|t| t.0.div_euclid(SECOND)));
        }
    }

    /// Parts of a file: for each, the connections with their seconds.
    type Parts<'a> = &'a [&'a [(u32, Vec<i64>)]];

    fn feed(parts: Parts<'_>, sink: &mut dyn Sink) {
        for part in parts {
            sink.part();
            for (id, seconds) in *part {
                let stamps: Vec<Stamp> = seconds.iter().map(|s| Stamp(s * SECOND)).collect();
                sink.stamps(ConnectionId(*id), &stamps, None);
            }
        }
    }

    fn seams(parts: Parts<'_>) -> Vec<Seam> {
        let mut kept = Kept::default();
        let mut watched = Watched::new(&mut kept);
        feed(parts, &mut watched);
        watched.seams()
    }

    #[test]
    fn a_run_is_shifted_behind_the_previous_one() {
        let parts: Parts<'_> = &[
            &[(0, (0..60).collect()), (1, vec![0, 30]), (2, vec![50])],
            // The second connection continues as if nothing had happened.
            &[(1, vec![58]), (0, (40..90).collect()), (2, vec![45])],
        ];
        let found = seams(parts);
        let reported: Vec<_> = falls(&found, true)
            .map(|f| (f.time.0 / SECOND, f.length / SECOND))
            .collect();
        assert_eq!(reported, [(59, 19)]);
        let mut kept = Kept::default();
        let mut moved = Straightened::new(&found, &mut kept);
        feed(parts, &mut moved);
        assert_eq!(kept.0[0], (0..60).chain(59..109).collect::<Vec<_>>());
        assert_eq!(kept.0[1], [0, 30, 77]);
    }

    #[test]
    fn a_run_begins_within_a_part_that_lists_one_connection_after_the_other() {
        let both = |last, again| (0..last).chain(again..90).collect();
        let parts: Parts<'_> = &[&[(0, both(60, 40)), (1, both(61, 41)), (2, vec![5, 55, 45])]];
        let found = seams(parts);
        let mut kept = Kept::default();
        let mut moved = Straightened::new(&found, &mut kept);
        feed(parts, &mut moved);
        assert_eq!(found.len(), 1);
        assert_eq!(kept.0[0], (0..60).chain(60..110).collect::<Vec<_>>());
        assert_eq!(kept.0[2], [5, 55, 65]);
    }

    #[test]
    fn a_connection_described_after_a_step_has_no_messages_before_it() {
        let parts: Parts<'_> = &[&[(0, (0..60).chain(40..90).collect()), (7, vec![70, 50, 71])]];
        let mut kept = Kept::default();
        feed(parts, &mut Straightened::new(&seams(parts), &mut kept));
        assert_eq!(kept.0[0].len(), 110);
        assert_eq!(kept.0[7].len(), 3);
    }

    #[test]
    fn a_rare_message_just_before_a_step_does_not_hide_it() {
        let parts: Parts<'_> = &[
            &[
                (0, (0..60).collect()),
                (1, (0..60).collect()),
                (2, vec![10, 42]),
            ],
            &[
                (0, (40..90).collect()),
                (1, (40..90).collect()),
                (2, vec![41]),
            ],
        ];
        assert_eq!(seams(parts).len(), 1);
    }

    #[test]
    fn topics_written_one_after_the_other_are_one_run() {
        let topic = |id| [(id, (0..60).collect())];
        assert_eq!(seams(&[&topic(0), &topic(1), &topic(2)]), []);
    }

    #[test]
    fn one_topic_out_of_order_is_one_run() {
        let parts: Parts<'_> = &[
            &[(0, (0..60).collect()), (1, (0..60).collect())],
            &[(0, (40..90).collect())],
            &[(1, (60..90).collect())],
        ];
        assert_eq!(seams(parts), []);
    }

    #[test]
    fn a_clock_set_for_the_first_time_begins_no_run() {
        let year = 366 * 86_400;
        let parts: Parts<'_> = &[
            &[(0, (year..year + 60).collect())],
            &[(0, (0..60).collect())],
        ];
        assert_eq!(seams(parts), []);
    }
}
