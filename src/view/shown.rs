//! The look of an item or arrow: its state, change and numbers in one window, and those of all windows in little memory,
//! without flicker from window to window.

use std::collections::{BTreeMap, BTreeSet};
use std::sync::Arc;

use super::{ArrowId, Counts, ItemId};
use crate::base::cast;
use crate::base::runs::Runs;
use crate::base::time::Span;
use crate::base::words::worded;
use crate::evidence::Confidence;
use crate::graph::State;
use crate::mission::event_log::EventId;

/// The sum of two numbers of which one, or both, may be unknown.
pub(super) fn sum<T>(a: Option<T>, b: Option<T>, add: impl Fn(T, T) -> T) -> Option<T> {
    match (a, b) {
        (Some(a), Some(b)) => Some(add(a, b)),
        (a, b) => a.or(b),
    }
}

worded! {
    /// The change of an item or arrow in a window; its word is that in SVG.
    #[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
    pub enum Mark {
        /// It began.
        Added = "added",
        /// It ended and is listed in this one window as a ghost, or left and returns in a later window.
        Removed = "removed",
        /// Its rate rose.
        Faster = "faster",
        /// Its rate fell.
        Slower = "slower",
        /// It is a topic whose messages now come from other senders.
        HandedOver = "handed-over",
        /// It is back: a node that ended and returned, or a silent element that publishes again.
        Restarted = "restarted",
        /// It paused.
        Paused = "paused",
        /// Its lifecycle state, type or quality of service changed.
        Changed = "changed",
        /// An element inside a group or a collapsed namespace was added, removed or changed.
        Inside = "inside",
        /// It is a node that left in an earlier window and returns in a later one.
        Away = "away",
    }
}

impl Mark {
    /// Those with a badge.
    pub(crate) fn badged() -> impl Iterator<Item = Self> {
        Self::ALL.into_iter().filter(|mark| *mark != Self::Away)
    }

    /// The class of its badge.
    pub(crate) fn badge(self) -> &'static str {
        match self {
            // All of them are changes.
            Self::Changed => "other",
            mark => mark.word(),
        }
    }

    /// The class in SVG: `added`, `removed`, `away` or `changed`.
    pub fn class(self) -> &'static str {
        match self {
            Self::Added => "added",
            Self::Removed => "removed",
            Self::Away => "away",
            _ => "changed",
        }
    }
}

/// The look of an item or arrow in one window.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Shown {
    /// Its index in `View::items` or `View::arrows`.
    pub id: u32,
    /// Its state; for a ghost, the last one before its end.
    pub state: State,
    /// The strength of the evidence for it.
    pub confidence: Confidence,
    /// Its change in the window, if any.
    pub mark: Option<Mark>,
    /// Messages per second in the window, if known.
    pub hz: Option<f64>,
    /// Messages per second, averaged over the time between the rate changes before and after this window.
    pub steady_hz: Option<f64>,
    /// The rate that is written, with its number of messages: that of an earlier window as long as the
    /// difference may be random.
    pub held: Option<(f64, Option<u64>)>,
    /// The rates of a still, or before, between and after the changes in the window, in messages per second; none if there is
    /// only one.
    pub steps: Vec<f64>,
    /// The node that sends it from now on, if `mark` is `HandedOver`.
    pub sender: Option<Arc<str>>,
    /// Whether it is silent or away during the whole window, with a beginning and an end in the event log, or
    /// before its first message.
    pub is_paused: bool,
    /// Whether the subscriber receives nothing because the qualities of service are incompatible.
    pub is_starved: bool,
    /// Whether its change is one of so many in the window that it has only a colour, without glow and badge.
    pub is_one_of_many: bool,
    /// The headlines behind `mark`, sorted: indices in the event log.
    pub events: Vec<EventId>,
    /// The topics that a bundle carries, sorted by index; empty for everything else.
    pub topics: Vec<TopicRow>,
    /// The number of equal namespaces it represents in the window; 0 for everything else.
    pub each: usize,
    /// The topics that it sends although the lines of bundles to their subscribers are not there; none for everything but
    /// boxes.
    pub unlined: Vec<Arc<str>>,
    /// The nodes and topics in a collapsed namespace in the graph of the window; none for everything else.
    pub members: Members,
    /// The number of headlines of each kind about elements inside a collapsed namespace or a bundle; `None` without any.
    pub inside: Option<Box<Counts>>,
    /// The number of messages in the window, if known.
    pub count: Option<u64>,
    /// The lifecycle state of a node, if it has one.
    pub lifecycle: Option<Arc<str>>,
}

/// The most messages per second that are shown as dots: with more, they would be closer than can be told apart.
pub(crate) const FASTEST: f64 = 4.5;

/// The thickest arrow's step: 1 kHz, faster than nearly all topics.
pub(crate) const STEPS: u8 = 6;

/// The width of a step's middle, in decades of 1 + Hz.
pub(crate) fn decades(step: u8) -> f64 {
    f64::from(step) / 2.0
}

/// The numbers of nodes and topics in a collapsed namespace that are in the graph of a window.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord)]
pub struct Members {
    /// The number of nodes.
    pub nodes: usize,
    /// The number of topics.
    pub topics: usize,
}

impl Members {
    /// The number written in the box: of its nodes, or of its topics if it has no nodes; `None` if it is not
    /// a collapsed namespace.
    pub(crate) fn number(self) -> Option<(usize, &'static str)> {
        match (self.nodes, self.topics) {
            (0, 0) => None,
            (0, topics) => Some((topics, "topic")),
            (nodes, _) => Some((nodes, "node")),
        }
    }
}

impl Shown {
    /// The item that looks like this.
    pub fn item(&self) -> ItemId {
        ItemId(self.id)
    }

    /// The arrow that looks like this.
    pub fn arrow(&self) -> ArrowId {
        ArrowId(self.id)
    }

    /// An element about which nothing else is known.
    pub fn plain(id: u32, state: State, confidence: Confidence) -> Self {
        Self {
            id,
            state,
            confidence,
            ..Self::default()
        }
    }

    /// Adds another element of the same item or arrow: the most active state and the strongest confidence are kept, rates
    /// and counts are summed.
    pub(crate) fn add(&mut self, other: &Self) {
        self.is_paused &= other.is_paused;
        self.is_starved &= other.is_starved;
        self.state = self.state.min(other.state);
        self.confidence = self.confidence.min(other.confidence);
        self.hz = sum(self.hz, other.hz, |a, b| a + b);
        self.count = sum(self.count, other.count, u64::saturating_add);
    }

    /// The rate that is written, and its number of messages, as far as they are known.
    pub(crate) fn written_rate(&self) -> (Option<f64>, Option<u64>) {
        match self.held {
            Some((hz, count)) => (Some(hz), count),
            None => (self.hz, self.count),
        }
    }

    /// The step of an arrow's thickness for its rate, 0..=[`STEPS`]: one per half a decade of 1 + Hz.
    pub(crate) fn width_step(&self) -> u8 {
        let hz = self.steady_hz.filter(|hz| hz.is_finite()).unwrap_or(0.0);
        let decades = libm::log10(1.0 + hz.max(0.0));
        cast::to_u8(libm::round(decades * 2.0).clamp(0.0, f64::from(STEPS)))
    }

    /// Whether its messages run along the arrow, and whether they run against it, if it is a bundle.
    pub(crate) fn ways(&self) -> [bool; 2] {
        [0, 1].map(|way| self.topics.iter().any(|row| row.ways[way]))
    }

    /// Whether messages run along it, and it lasts.
    pub(crate) fn is_sending(&self) -> bool {
        self.state == State::Active && !self.is_paused && !self.is_starved && !self.is_ghost()
    }

    /// The messages per second along the arrow and against it, in hundredths: to two digits, so that a small change is none, and at
    /// most [`FASTEST`].
    pub(crate) fn flow(&self) -> [u32; 2] {
        if !self.is_sending() {
            return [0, 0];
        }
        let rounded = |hz: f64| {
            let step = if hz < 1.0 { 1.0 } else { 10.0 };
            cast::to_u32(libm::round(hz.clamp(0.0, FASTEST) * 100.0 / step) * step)
        };
        let rows = |way: usize| self.topics.iter().filter(move |row| row.ways[way]);
        match self.topics.len() {
            0 => [rounded(self.written_rate().0.unwrap_or(0.0)), 0],
            _ => [0, 1].map(|way| rounded(rows(way).filter_map(|row| row.hz).sum())),
        }
    }

    /// Whether its rate changed in the window.
    pub(crate) fn has_new_rate(&self) -> bool {
        matches!(self.mark, Some(Mark::Faster | Mark::Slower)) && self.steps.len() > 1
    }

    /// The mark that its badge shows, if it has one.
    pub(crate) fn badge(&self) -> Option<Mark> {
        self.mark.filter(|_| !self.is_one_of_many)
    }

    /// Whether it ended in the window.
    pub(crate) fn is_ghost(&self) -> bool {
        self.mark == Some(Mark::Removed)
    }

    /// Makes it the look of a service, whose lack of messages does not mean silence.
    pub(super) fn is_called(&mut self) {
        (self.state, self.is_paused) = (self.state.min(State::Active), false);
    }

    /// The topics of a bundle, those that changed first, then those with the highest rate.
    pub(crate) fn by_rate(&self) -> impl Iterator<Item = &TopicRow> {
        let mut rows: Vec<&TopicRow> = self.topics.iter().collect();
        let hz = |row: &TopicRow| row.hz.unwrap_or(0.0);
        rows.sort_by(|a, b| {
            let changed = b.mark.is_some().cmp(&a.mark.is_some());
            changed
                .then(hz(b).total_cmp(&hz(a)))
                .then(a.topic.cmp(&b.topic))
        });
        rows.into_iter()
    }
}

/// A topic on a line between two boxes in a window, or several that are shown as one.
#[derive(Clone, Debug, PartialEq)]
pub struct TopicRow {
    /// Its index in `Arrow::topics`.
    pub topic: u32,
    /// Whether its messages run along the arrow, and whether they run against it.
    pub ways: [bool; 2],
    /// Whether it is a service.
    pub is_service: bool,
    /// Whether the subscriber receives nothing because the qualities of service are incompatible.
    pub is_starved: bool,
    /// Its state.
    pub state: State,
    /// Messages per second in the window, if known.
    pub hz: Option<f64>,
    /// The number of messages in the window, if known.
    pub count: Option<u64>,
    /// Its change, if different from that of the whole line.
    pub mark: Option<Mark>,
    /// The rates of a still, or before, between and after the changes in the window, in messages per second; none if there is
    /// only one.
    pub steps: Vec<f64>,
}

/// The properties that distinguish unmarked topics of a bundle.
pub(crate) type RowKey = (u32, [bool; 2], bool, State, [Option<u64>; 2]);

impl TopicRow {
    /// An unmarked topic that looks like this.
    pub(crate) fn of(topic: u32, ways: [bool; 2], shown: &Shown) -> Self {
        Self {
            topic,
            ways,
            is_service: false,
            is_starved: shown.is_starved,
            state: shown.state,
            hz: shown.hz,
            count: shown.count,
            mark: None,
            steps: Vec::new(),
        }
    }

    /// Adds the same topic on another line; messages of different senders are summed.
    pub(crate) fn join(&mut self, other: &Self, is_other_sender: bool) {
        let is_sum = is_other_sender && self.count.is_some() && other.count.is_some();
        if is_sum {
            self.hz = sum(self.hz, other.hz, |a, b| a + b);
            self.count = sum(self.count, other.count, |a, b| a + b);
        } else {
            self.hz = sum(self.hz, other.hz, f64::max);
            self.count = sum(self.count, other.count, u64::max);
        }
        self.state = self.state.min(other.state);
        self.ways = [0, 1].map(|way| self.ways[way] || other.ways[way]);
    }

    pub(crate) fn key(&self) -> RowKey {
        (
            self.topic,
            self.ways,
            self.is_starved,
            self.state,
            [self.hz.map(f64::to_bits), self.count],
        )
    }
}

/// The looks of one item or arrow, window by window.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ShownRuns {
    /// Each look only once unless it is marked.
    distinct: Vec<Shown>,
    /// The index of the look, or [`AWAY`].
    runs: Runs<u32>,
}

/// The index that means absence.
const AWAY: u32 = u32::MAX;

impl ShownRuns {
    /// The look in a window; `None` if it is absent.
    pub fn at(&self, window: usize) -> Option<&Shown> {
        let look = self.runs.at(u32::try_from(window).unwrap_or(u32::MAX))?;
        self.distinct.get(look as usize)
    }

    /// Every look that it ever has, in no particular order.
    pub fn distinct(&self) -> &[Shown] {
        &self.distinct
    }

    /// Its looks with the window from which each applies, in order; `None` if it is absent, as before the
    /// first of these.
    pub fn runs(&self) -> impl DoubleEndedIterator<Item = (u32, Option<&Shown>)> + Clone {
        let look = |place: u32| self.distinct.get(place as usize);
        let runs = self.runs.0.iter();
        runs.map(move |(window, place)| (*window, look(*place)))
    }

    /// Sets the id of all its looks.
    pub(super) fn renumber(&mut self, id: u32) {
        for look in &mut self.distinct {
            look.id = id;
        }
    }

    /// Its looks in order, each with its first window, the first window after it, and its index; the last applies to the
    /// end of all `windows`.
    pub(crate) fn spans(&self, windows: u32) -> impl Iterator<Item = (u32, u32, u32, &Shown)> {
        let look = |(from, to, place)| Some((from, to, place, self.distinct.get(place as usize)?));
        self.runs.spans(windows).filter_map(look)
    }

    /// The windows in which one of `all` changes.
    pub(crate) fn turns<'a>(all: impl Iterator<Item = &'a Self>) -> BTreeSet<u32> {
        all.flat_map(Self::runs).map(|run| run.0).collect()
    }

    /// The looks made by `look` in the windows in which one of `all` changes.
    pub(crate) fn made_of<'a>(
        all: impl Iterator<Item = &'a Self>,
        look: impl Fn(usize) -> Option<Shown>,
    ) -> Self {
        let mut writer = ShownRunsWriter::default();
        for window in Self::turns(all) {
            writer.show(window, look(window as usize));
        }
        writer.finish()
    }

    /// The looks in the windows of a sequence, one event per window.
    pub fn of<'a>(windows: impl IntoIterator<Item = Option<&'a Shown>>) -> Self {
        let mut writer = ShownRunsWriter::default();
        for (window, shown) in (0..).zip(windows) {
            writer.show(window, shown.cloned());
        }
        writer.finish()
    }
}

/// A writer that adds looks in order of the windows.
#[derive(Debug, Default)]
pub(super) struct ShownRunsWriter {
    looks: ShownRuns,
    /// The indices of looks without a mark, if there are more than [`FEW`] looks.
    places: BTreeMap<LookKey, u32>,
}

/// The number of looks that are searched one by one: most items have no more, and a map for each would take
/// more memory than everything else.
const FEW: usize = 4;

/// The properties that distinguish looks without marks.
type LookKey = (
    (State, Confidence, bool, bool),
    [Option<u64>; 5],
    (usize, Members),
    Vec<RowKey>,
    Option<Arc<str>>,
    Vec<Arc<str>>,
);

impl ShownRunsWriter {
    /// Adds the look from this window on; `None` if it is absent.
    pub(super) fn show(&mut self, window: u32, shown: Option<Shown>) {
        let place = shown.map_or(AWAY, |shown| self.look(shown));
        self.turn(window, place);
    }

    /// The index of a look. A look with a mark gets a new index each time.
    pub(super) fn look(&mut self, shown: Shown) -> u32 {
        let is_plain = shown.mark.is_none();
        if is_plain && let Some(place) = self.place(&shown) {
            return place;
        }
        let all = &mut self.looks.distinct;
        let next = u32::try_from(all.len()).unwrap_or(AWAY - 1);
        if all.len() <= FEW {
            all.reserve_exact(1);
        }
        if is_plain && all.len() > FEW {
            self.places.insert(key(&shown), next);
        }
        all.push(shown);
        next
    }

    /// The index of a look without a mark, if it exists already.
    fn place(&mut self, shown: &Shown) -> Option<u32> {
        let wanted = key(shown);
        let all = (0..).zip(&self.looks.distinct);
        let mut plain = all.filter(|(_, look)| look.mark.is_none());
        if self.looks.distinct.len() <= FEW {
            let found = plain.find(|(_, look)| key(look) == wanted);
            return found.map(|(place, _)| place);
        }
        if self.places.is_empty() {
            let places = plain.map(|(place, look)| (key(look), place));
            self.places = places.collect();
        }
        self.places.get(&wanted).copied()
    }

    /// Adds the index of the look from this window on.
    pub(super) fn turn(&mut self, window: u32, place: u32) {
        self.looks.runs.push(window, place, AWAY);
    }

    pub(super) fn finish(mut self) -> ShownRuns {
        self.looks.runs.0.shrink_to_fit();
        self.looks.distinct.shrink_to_fit();
        self.looks
    }
}

fn key(shown: &Shown) -> LookKey {
    let bits = |hz: Option<f64>| hz.map(f64::to_bits);
    let written = (shown.held.map(|held| held.0), shown.held.and_then(|h| h.1));
    (
        (
            shown.state,
            shown.confidence,
            shown.is_paused,
            shown.is_starved,
        ),
        [
            bits(shown.hz),
            bits(shown.steady_hz),
            shown.count,
            bits(written.0),
            written.1,
        ],
        (shown.each, shown.members),
        shown.topics.iter().map(TopicRow::key).collect(),
        shown.lifecycle.clone(),
        shown.unlined.clone(),
    )
}

// The look of an element over several windows, without flicker from window to window.

/// The length of all windows before each, in nanoseconds; the last entry is the length of all.
pub(crate) struct Lengths(Vec<i64>);

impl Lengths {
    pub(crate) fn new(windows: impl Iterator<Item = Span>) -> Self {
        let mut whole = 0_i64;
        let mut all = vec![0];
        all.extend(windows.map(|span| {
            whole = whole.saturating_add(span.nanos());
            whole
        }));
        Self(all)
    }

    /// The length of the windows `from..to`, in nanoseconds.
    pub(crate) fn of(&self, from: u32, to: u32) -> f64 {
        let at = |window: u32| self.0.get(window as usize).copied().unwrap_or(0);
        (at(to) - at(from)) as f64
    }

    pub(crate) fn windows(&self) -> u32 {
        u32::try_from(self.0.len() - 1).unwrap_or(u32::MAX)
    }
}

/// The facts gathered so far about an element's current lifetime.
#[derive(Clone, Copy, Default)]
struct PresentLife {
    look: Option<(State, Confidence)>,
    /// Messages and nanoseconds since its rate last changed.
    sent: (f64, f64),
    /// Nanoseconds since the last window with messages.
    idle: f64,
    is_measured: bool,
    /// The rate that is written, with its number of messages.
    held: Option<(f64, Option<u64>)>,
}

/// A look in some consecutive windows.
struct ShownRun<'a> {
    from: u32,
    to: u32,
    place: u32,
    shown: &'a Shown,
    /// Its stable state, confidence and average rate.
    look: (State, Confidence),
    steady_hz: Option<f64>,
    held: Option<(f64, Option<u64>)>,
}

/// Gives an item or arrow its most active state and its strongest confidence for as long as it exists, and
/// its average rate between two rate changes.
///
/// A topic with a message per minute is also active in the seconds in between; only a pause in the event log
/// is drawn as one.
pub(crate) fn stable(raw: &ShownRuns, lengths: &Lengths) -> ShownRuns {
    let mut runs = runs(raw, lengths.windows());
    let mut life = PresentLife::default();
    let mut last = 0;
    for run in &mut runs {
        if last != run.from || run.shown.mark == Some(Mark::Added) {
            life = PresentLife::default();
        }
        life.forward(run, lengths);
        last = if run.shown.is_ghost() { 0 } else { run.to };
    }
    // Backwards, so that facts known at the end of a lifetime apply to all of it.
    let mut next = u32::MAX;
    for run in runs.iter_mut().rev() {
        if next != run.to || run.shown.is_ghost() {
            life = PresentLife::default();
        }
        life.backward(run);
        next = if run.shown.mark == Some(Mark::Added) {
            u32::MAX
        } else {
            run.from
        };
    }
    written(&runs, lengths.windows())
}

fn runs(raw: &ShownRuns, windows: u32) -> Vec<ShownRun<'_>> {
    let runs = raw.spans(windows);
    let runs = runs.map(|(from, to, place, shown)| ShownRun {
        from,
        to,
        place,
        shown,
        look: (shown.state, shown.confidence),
        steady_hz: None,
        held: None,
    });
    runs.collect()
}

impl PresentLife {
    fn forward(&mut self, run: &mut ShownRun<'_>, lengths: &Lengths) {
        let shown = run.shown;
        if is_rate(shown) {
            (self.sent, self.idle, self.is_measured) = ((0.0, 0.0), 0.0, false);
        }
        if !shown.is_paused {
            let old = self.look.unwrap_or(run.look);
            self.look = Some((livelier(old.0, run.look.0), old.1.min(run.look.1)));
        }
        // The rate of a ghost is not shown.
        let is_own = !shown.is_paused && !shown.is_ghost();
        if let Some(hz) = shown.hz.filter(|hz| hz.is_finite() && is_own) {
            // Its rate is that from the first message to the last.
            let length = lengths.of(run.from, run.to);
            if hz > 0.0 {
                let time = self.sent.1 + self.idle + length;
                (self.sent, self.idle) = ((self.sent.0 + hz * length, time), 0.0);
            } else if self.sent.0 > 0.0 {
                self.idle += length;
            }
            self.is_measured = true;
        }
        let (sent, time) = self.sent;
        run.steady_hz = self.is_measured.then(|| sent / time.max(1.0));
        let seconds = lengths.of(run.from, run.from + 1) / 1e9;
        // A window with an event shows the event's number, and a few messages make no rate.
        let is_few = shown.count.is_some_and(|count| count < FEWEST);
        if shown.mark.is_some() || is_few && self.held.is_none() {
            self.held = None;
        } else if self.held.is_none_or(|held| differs(held.0, shown, seconds)) {
            self.held = shown.hz.map(|hz| (hz, shown.count)).filter(|_| !is_few);
        }
        run.held = self.held;
        self.show(run);
    }

    fn backward(&mut self, run: &mut ShownRun<'_>) {
        if !run.shown.is_paused {
            self.look = self.look.or(Some(run.look));
        }
        // `sent` contains the rate from here to its next change.
        if self.is_measured {
            run.steady_hz = Some(self.sent.0);
        }
        self.sent = (run.steady_hz.unwrap_or(0.0), 0.0);
        self.is_measured = run.steady_hz.is_some() && !is_rate(run.shown);
        self.show(run);
    }

    fn show(&self, run: &mut ShownRun<'_>) {
        if let Some(look) = self.look.filter(|_| !run.shown.is_paused) {
            run.look = look;
        }
    }
}

/// The runs with their stable looks.
fn written(runs: &[ShownRun<'_>], windows: u32) -> ShownRuns {
    let mut writer = ShownRunsWriter::default();
    let look = |run: &ShownRun<'_>| (run.look, run.steady_hz, run.held);
    let is_same = |a: &ShownRun<'_>, b: &ShownRun<'_>| look(a) == look(b);
    // Between two changes only the numbers differ, and only a few of them.
    let mut places: Vec<Option<u32>> = Vec::new();
    let mut before: Option<&ShownRun<'_>> = None;
    for run in runs {
        if before.is_none_or(|before| !is_same(before, run)) {
            places.clear();
        }
        if let Some(before) = before.filter(|before| before.to < run.from) {
            writer.show(before.to, None);
        }
        let at = run.place as usize;
        places.resize(places.len().max(at + 1), None);
        let place = *places[at].get_or_insert_with(|| {
            let (state, confidence) = run.look;
            writer.look(Shown {
                state,
                confidence,
                steady_hz: run.steady_hz,
                held: run.held,
                ..run.shown.clone()
            })
        });
        writer.turn(run.from, place);
        before = Some(run);
    }
    if let Some(last) = before.filter(|last| last.to < windows) {
        writer.show(last.to, None);
    }
    writer.finish()
}

/// The least difference of a rate that changes the number that is written: as a share, and in standard deviations of
/// the number of messages.
const DIFFERENT: (f64, f64) = (0.25, 2.0);

/// The fewest messages in a window that make a rate: of four, one more or less is a quarter, the least difference that
/// counts.
const FEWEST: u64 = 5;

/// Whether the rate of a window of so many seconds differs from `held` by more than chance.
fn differs(held: f64, shown: &Shown, seconds: f64) -> bool {
    let by = shown.hz.map_or(0.0, |hz| (hz - held).abs());
    let is_chance =
        shown.count.is_some() && by * seconds <= DIFFERENT.1 * libm::sqrt(held * seconds);
    by > DIFFERENT.0 * held && !is_chance
}

fn is_rate(shown: &Shown) -> bool {
    matches!(shown.mark, Some(Mark::Faster | Mark::Slower))
}

/// The more active of two states. Latched counts most, since it is more informative than active.
fn livelier(a: State, b: State) -> State {
    let rank = |state| (state != State::Latched, state);
    if rank(a) <= rank(b) { a } else { b }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::base::time::Stamp;

    #[expect(clippy::unnecessary_wraps, reason = "lists of optional looks")]
    fn shown(hz: f64, mark: Option<Mark>) -> Option<Shown> {
        Some(Shown {
            hz: Some(hz),
            mark,
            ..Shown::plain(7, State::Active, Confidence::Measured)
        })
    }

    #[test]
    fn shown_elements_can_be_looked_up() {
        let all = [
            None,
            shown(1.0, Some(Mark::Added)),
            shown(1.0, None),
            shown(2.0, None),
            shown(1.0, None),
            None,
        ];
        let looks = ShownRuns::of(all.iter().map(Option::as_ref));
        for (window, want) in all.iter().enumerate() {
            assert_eq!(looks.at(window), want.as_ref(), "{window}");
        }
        assert_eq!(looks.at(99), None);
        assert_eq!(looks.distinct().len(), 3);
    }

    #[test]
    fn equal_looks_are_stored_once() {
        let all: Vec<_> = (0..100).map(|n| shown(f64::from(n % 20), None)).collect();
        let looks = ShownRuns::of(all.iter().map(Option::as_ref));
        assert_eq!(looks.distinct().len(), 20);
        assert_eq!(looks.at(57), all[57].as_ref());
    }

    #[test]
    fn constant_elements_take_no_memory() {
        let (slow, fast) = (shown(1.0, None), shown(2.0, None));
        let all = (0..10_000).map(|n| if n < 5000 { &slow } else { &fast });
        let looks = ShownRuns::of(all.map(Option::as_ref));
        assert_eq!((looks.distinct().len(), looks.runs().count()), (2, 2));
    }

    #[test]
    fn two_series_of_looks_are_paired_by_window() {
        let (one, two) = (shown(1.0, None), shown(2.0, None));
        let a = ShownRuns::of([one.as_ref(), one.as_ref(), two.as_ref()]);
        let b = ShownRuns::of([None, one.as_ref(), one.as_ref()]);
        let hz = |shown: Option<&Shown>| shown.and_then(|s| s.hz);
        let turns = ShownRuns::turns([&a, &b].into_iter());
        let looks = turns.into_iter().map(|window| {
            let at = |looks: &ShownRuns| hz(looks.at(window as usize));
            (at(&a), at(&b))
        });
        let reported: Vec<_> = looks.collect();
        let want = [(1.0, None), (1.0, Some(1.0)), (2.0, Some(1.0))];
        assert_eq!(reported, want.map(|(a, b)| (Some(a), b)));
    }

    /// The rate that is written in each window of ten seconds with so many messages.
    fn written_rates(counts: &[u64]) -> Vec<f64> {
        let shown = |count: &u64| Shown {
            hz: Some(*count as f64 / 10.0),
            count: Some(*count),
            ..Shown::plain(0, State::Active, Confidence::Measured)
        };
        let shown: Vec<Shown> = counts.iter().map(shown).collect();
        let window = Span::new(Stamp(0), Stamp(10_000_000_000));
        let lengths = Lengths::new(counts.iter().map(|_| window));
        let looks = stable(&ShownRuns::of(shown.iter().map(Some)), &lengths);
        let rate = |at| looks.at(at)?.written_rate().0;
        (0..counts.len()).filter_map(rate).collect()
    }

    #[test]
    fn an_average_rate_is_that_from_the_first_message_to_the_last() {
        let shown = [0, 100, 0, 50, 0].map(|count| Shown {
            hz: Some(f64::from(count) / 10.0),
            ..Shown::plain(0, State::Active, Confidence::Measured)
        });
        let window = Span::new(Stamp(0), Stamp(10_000_000_000));
        let lengths = Lengths::new(shown.iter().map(|_| window));
        let looks = stable(&ShownRuns::of(shown.iter().map(Some)), &lengths);
        let steady = (0..5).map(|at| looks.at(at).unwrap().steady_hz);
        assert_eq!(steady.collect::<Vec<_>>(), [Some(5.0); 5]);
    }

    #[test]
    fn a_written_rate_ends_where_chance_does_not_explain_the_number() {
        let by_chance = written_rates(&[71, 80, 64, 71]);
        assert_eq!(by_chance, [7.1, 7.1, 7.1, 7.1]);
        // No messages, and a few.
        assert_eq!(written_rates(&[71, 0, 3, 70]), [7.1, 0.0, 0.3, 7.0]);
        assert_eq!(written_rates(&[6, 5, 0, 6]), [0.6, 0.6, 0.0, 0.6]);
    }
}
