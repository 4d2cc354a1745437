//! Reads every bag once and gathers its evidence.

use super::copies::{self, Copies, Rest};
use super::inputs::{affordable, check_named, each_once, in_time, space_of};
use super::{Reading, Watch};
use crate::bag::straight::{self, ClockFall, Seam, Straightened, Watched};
use crate::bag::{self, Input, OpenOptions, Report, known_span};
use crate::base::error::{Error, Result};
use crate::base::ids::ById;
use crate::base::notice::{Notice, NoticeKind, Notices};
use crate::base::time::Span;
use crate::base::words;
use crate::evidence::clock;
use crate::evidence::collector::{Collector, Recorded};
use crate::graph::{self, window};

/// The bags of a mission, read.
pub(super) struct Collected {
    /// The bags, in the order of their indices.
    pub(super) inputs: Vec<Input>,
    pub(super) reports: Vec<Report>,
    pub(super) recorded: Recorded,
    /// The time range that is divided into windows.
    pub(super) range: Span,
}

/// A bag that was read.
struct ReadBag {
    report: Report,
    seams: Vec<Seam>,
    /// The number of its messages that were left out because they are recorded twice.
    left_out: u64,
}

/// Reads every bag once, and again if several recorded one robot or two recordings of it were merged; with `verify` by the second,
/// independent reader. Adds the offsets of clocks that it finds to the reading.
pub(super) fn collect(
    reading: &mut Reading,
    verify: bool,
    watch: &mut dyn Watch,
) -> Result<Collected> {
    let mut merged = None;
    let mut all = once(reading, &Copies::default(), &mut merged, verify, watch)?;
    let parts = graph::parts(&all.recorded);
    let pairs = copies::pairs(reading, &all.inputs, &all.recorded, &parts)?;
    let (mut shifts, mut notices) = copies::correct(reading, &pairs, &all.inputs);
    let mut again = |shifts: &ById<usize, i64>, left_out: &Copies| {
        if let Some(merged) = &mut merged {
            copies::moved(merged, shifts);
        }
        once(reading, left_out, &mut merged, verify, watch)
    };
    // By a clock that is years apart, all messages of a bag were set aside.
    let spans = copies::spans(&all.recorded);
    let is_aside = |(bag, by): (usize, &i64)| *by != 0 && spans.some(bag).is_none();
    if shifts.with_ids().any(is_aside) {
        all = again(&shifts, &Copies::default())?;
        shifts = ById::default();
    }
    let left_out = copies::copies(&all.recorded, &pairs, &shifts)?;
    if !notices.is_empty() || !left_out.is_empty() {
        all = again(&shifts, &left_out)?;
        all.recorded.parts = parts;
    }
    let offsets = &all.recorded.offsets;
    for of_bag in offsets.chunk_by(|a, b| a.bag == b.bag) {
        let first = of_bag.iter().find(|offset| offset.is_apart());
        notices.extend(first.map(|offset| copies::apart(reading, offset, &all.inputs, false)));
    }
    all.recorded.notices.extend(notices);
    Ok(all)
}

/// Reads every bag once, without messages that another one contains, or that it contains twice (`merged`), which it finds if that is not
/// known yet.
fn once(
    reading: &Reading,
    copies: &Copies,
    merged: &mut Option<Copies>,
    verify: bool,
    watch: &mut dyn Watch,
) -> Result<Collected> {
    let options = OpenOptions { verify };
    let (inputs, twice) = each_once(&reading.inputs)?;
    let whole: u64 = inputs.iter().filter_map(bag::size_on_disk).sum();
    check_named(reading, &inputs)?;
    let readers = bag::open_each(inputs.clone(), &options).zip(&inputs);
    let readers = readers.map(|(reader, input)| Ok(in_time(reading, input, reader?)));
    let mut readers = readers.collect::<Result<Vec<_>>>()?;
    let cut = reading.division.start.is_some() || reading.division.end.is_some();
    // If time goes back, a part of the mission is not a range of times: such a part is cut out once all is read.
    let is_range = cut && readers.iter().all(|reader| reader.is_straight());
    let known = is_range.then(|| known_span(&mut readers)).transpose()?;
    let known = known.flatten().filter(|span| clock::is_sure(*span));
    let range = known.map(|span| window::range(&reading.division, span));
    let range = range.transpose()?;
    let spaces: Vec<String> = inputs.iter().map(|i| space_of(reading, i)).collect();
    let mut pass = |seams: &[Vec<Seam>], merged: &Copies| {
        let mut collector = Collector::new(affordable(reading));
        let (mut before, mut size, mut all) = (0, 0, Vec::new());
        for (bag, (reader, space)) in readers.iter_mut().zip(&spaces).enumerate() {
            let mut progress = |done, total: u64| {
                size = total;
                watch.progress(before + done, whole.max(before + total));
            };
            let mut sink = collector.bag_in(space, &mut progress);
            let mut rest = Rest::new(&mut sink, copies, bag);
            let seams = seams.get(bag).map_or(&[][..], Vec::as_slice);
            let mut straight = Straightened::new(seams, &mut rest);
            let mut watched = Watched::new(&mut straight);
            let mut once = Rest::new(&mut watched, merged, bag);
            let report = reader.read(range, &mut once)?;
            let again = once.left_out;
            all.push(ReadBag {
                report,
                seams: watched.seams(),
                left_out: again + rest.left_out,
            });
            before += std::mem::take(&mut size);
        }
        Ok::<_, Error>((collector.finish()?, all))
    };
    let (mut recorded, mut all) = pass(&[], merged.as_ref().unwrap_or(&Copies::default()))?;
    let mut seams: Vec<Vec<Seam>> = all.iter().map(|bag| bag.seams.clone()).collect();
    let is_pipe = inputs.iter().any(Input::is_pipe);
    let (is_known, found) = match merged.take() {
        Some(known) => (true, known),
        None => (false, copies::merged(reading, &inputs, &recorded, &seams)?),
    };
    let merged = merged.insert(found);
    // What is only in the recording that was appended to another begins no run.
    for (bag, _) in merged.with_ids().filter(|(_, own)| !own.is_empty()) {
        seams[bag].clear();
    }
    let is_straight = seams.iter().all(Vec::is_empty);
    if !is_pipe && (!is_straight || !is_known && !merged.is_empty()) {
        (recorded, all) = pass(&seams, merged)?;
    }
    let Some(whole) = known.or(recorded.span) else {
        return Err(no_messages(&reading.inputs, &recorded.notices));
    };
    let range = match range {
        Some(range) => range,
        None => window::range(&reading.division, whole)?,
    };
    if cut {
        recorded.cut(range, range.start <= whole.start)?;
    }
    recorded.notices.extend(twice);
    recorded.notices.extend(gap(&recorded, &inputs));
    let notices = all.iter().zip(&inputs);
    let notices = notices.filter_map(|(bag, input)| twice_recorded(bag.left_out, input));
    recorded.notices.extend(notices);
    let falls = seams.iter();
    let falls = falls.flat_map(|seams| straight::falls(seams, !is_pipe));
    let is_kept = |fall: &ClockFall| recorded.span.is_some_and(|span| span.contains(fall.time));
    recorded.falls = falls.filter(is_kept).collect();
    recorded.falls.sort_unstable();
    recorded.overlaps = is_pipe && !is_straight;
    for fall in &recorded.falls {
        let length = words::duration(fall.length);
        let shown = if is_pipe {
            "overlap, since a pipe cannot be read again: give the file"
        } else {
            "are shown one after the other"
        };
        let text = format!("{SET_BACK} {length}; the two runs {shown}");
        recorded.notices.add(Notice::new(NoticeKind::Note, text));
    }
    if recorded.span.is_none() {
        return Err(no_messages(&reading.inputs, &recorded.notices));
    }
    Ok(Collected {
        inputs,
        reports: all.into_iter().map(|bag| bag.report).collect(),
        recorded,
        range,
    })
}

/// The notice about the longest time between two recordings, if it is longer than all of them together: they are several runs.
fn gap(recorded: &Recorded, inputs: &[Input]) -> Option<Notice> {
    // Each ends a nanosecond after its last message.
    let spans = copies::spans(recorded);
    let whole: i64 = spans.somes().map(|(_, span)| span.nanos() - 1).sum();
    let mut spans: Vec<(usize, Span)> = spans.somes().map(|(bag, span)| (bag, *span)).collect();
    spans.sort_by_key(|(_, span)| span.start);
    let mut before = *spans.first()?;
    let mut longest: Option<(i64, usize, usize)> = None;
    for (bag, span) in spans {
        let gap = span.start.since(before.1.end) + 1;
        if gap > whole && longest.is_none_or(|(other, ..)| gap > other) {
            longest = Some((gap, before.0, bag));
        }
        if span.end > before.1.end {
            before = (bag, span);
        }
    }
    let (gap, before, after) = longest?;
    let [before, after] = [before, after].map(|bag| inputs.get(bag).map(Input::name));
    let text = format!(
        "`{}` begins {} after `{}` ends, longer than the recordings are: give one run at a time, or two to `bagreel diff`",
        after?,
        words::duration(gap),
        before?,
    );
    Some(Notice::new(NoticeKind::Apart, text))
}

/// The notice about messages of a bag that another one, or the same, contains before, if there are `many` of them.
fn twice_recorded(many: u64, input: &Input) -> Option<Notice> {
    let (count, name) = (words::count(many, "message"), input.name());
    let text = format!("left out {count} of `{name}`, recorded twice");
    (many > 0).then(|| Notice::new(NoticeKind::Note, text))
}

/// The beginning of the notice about a clock that was set back.
const SET_BACK: &str = "the recorder's clock went back by";

/// The message for an intact, empty bag.
pub(super) const NOTHING_RECORDED: &str = "the recording is empty";

/// The error for bags without messages, including losses.
pub(super) fn no_messages(inputs: &[Input], notices: &Notices) -> Error {
    let lost = notices.iter().filter(|n| n.kind.is_loss()).take(3);
    let lost = lost.map(|n| format!("{} (×{})", n.text, n.count));
    let name = inputs.iter().map(Input::name).min().unwrap_or_default();
    let hint = match words::joined(lost, "; ") {
        none if none.is_empty() => NOTHING_RECORDED.to_owned(),
        lost => lost,
    };
    Error::no_messages(&name, hint)
}
