//! The data for the script of a page: names, facts and runs as JSON, deflated if long.

use std::collections::{BTreeMap, BTreeSet};

use serde::{Serialize, Serializer};

use super::{ChangedWindow, HtmlPage, PageChanges, PageClock, PageGraph};
use crate::base::geometry::Rect;
use crate::base::ids::grouped;
use crate::base::name::is_log;
use crate::base::runs::Runs;
use crate::base::time::{Span, Stamp};
use crate::base::words::{self, visible};
use crate::base::{cast, digest};
use crate::draw::paint::classes::ElementLook;
use crate::draw::picture::title::SIDES;
use crate::draw::timeline::Timeline;
use crate::draw::timeline::marks::{RowMark, Sign};
use crate::draw::timeline::rows::{Level, Row};
use crate::evidence::{Confidence, Evidence};
use crate::graph::history::Sender;
use crate::graph::{Element, Elements, Id as _, Node, NodeId};
use crate::mission::info::is_ros1;
use crate::mission::{EventId, Mission};
use crate::view::{Arrow, ArrowKind, Item, Mark, Shown, ShownRuns, TopicRow, View};

/// The number of bytes from which on data is deflated.
const LONG: usize = 1_000_000;

/// The data for the script, defined here alone; `player/data.js` reads it.
///
/// Times are seconds since the start of the first window. An *element* is a number: items first, then arrows in
/// painting order, both of the fully expanded graph unless stated otherwise. A *run list* is `[windows since the
/// previous run, value, …]`; a value applies until the next.
#[derive(Serialize)]
struct PageData<'a> {
    /// The graph with all elements separately; then that of the picture, if it groups elements.
    graphs: Vec<GraphData<'a>>,
    /// The sentences that `facts` refer to.
    words: Vec<String>,
    /// The start and the end of each window.
    starts: Vec<f64>,
    ends: Vec<f64>,
    /// Milliseconds since 1970 at the start of the first window.
    epoch: i64,
    /// The headlines of each window that has any.
    reported: &'a [ChangedWindow],
    /// Start, end and name of each phase.
    phases: Vec<(f64, f64, String)>,
    /// The lifelines, from top to bottom.
    rows: Vec<RowData>,
    /// Takeovers: the time, the old row, the new row, and the event's index in the log.
    takeovers: Vec<(f64, usize, usize, EventId)>,
    /// The lifetimes of each node, by its element.
    lives: Vec<(u32, Vec<LastSigns>)>,
    /// Font sizes: of rates, topics' names, nodes' names, namespaces' titles.
    sizes: [f64; 4],
    /// The titles of the two windows of a comparison; absent otherwise.
    #[serde(skip_serializing_if = "Option::is_none")]
    sides: Option<[&'static str; 2]>,
    /// The window to begin with.
    still: usize,
    /// The smallest relative change of a rate that is reported.
    change: f64,
}

/// A graph.
#[derive(Serialize)]
struct GraphData<'a> {
    /// Per item: its name.
    names: Vec<String>,
    /// Per item: 0 node, 1 topic, 2 group of topics, 3 namespace.
    kinds: Vec<u8>,
    /// Per item: x, y, width, height.
    boxes: Vec<[i64; 4]>,
    /// Per arrow: its ends, and the topic that it carries from node to node.
    arrows: Vec<(u32, u32, String)>,
    /// Per element: indices into `words`.
    facts: Vec<Vec<u32>>,
    /// Class names of values of run lists.
    classes: &'a [String],
    /// Rates, lifecycle states, and rate changes as text; rates as numbers.
    labels: &'a [String],
    /// Per element, run lists: of classes, of rates as drawn, of lifecycle states, of rate changes, whose values apply
    /// to one window, and of the messages per second of each window. Empty lists at the end are left out.
    runs: Vec<&'a ElementRuns>,
    /// Per item of the picture: its members.
    members: Vec<Vec<u32>>,
}

/// A lifeline: its element (-1 for a namespace's title), its name, 1 below such a title, its lifetimes as
/// `[start, end, 1 by inference only, …]`, its times of publishing as `[start, end, ninths of its highest
/// rate, …]`, and its events as their times, signs and indices in the log.
#[derive(Serialize)]
struct RowData(i64, String, u8, Vec<f64>, Vec<f64>, Vec<(f64, u8, EventId)>);

/// A lifetime of a node: its start and its end, its last message as time and topic, and the last texts that it logged, each
/// with its time.
#[derive(Serialize)]
struct LastSigns(f64, f64, Option<(f64, String)>, Vec<(f64, String)>);

/// The data as JSON that is safe between the tags of a page.
pub(super) fn json(page: &HtmlPage<'_>, still: usize, changes: &PageChanges) -> String {
    let whole = &page.whole;
    let mission = page.sequence.mission;
    let frames = &whole.view.frames;
    let (clock, places) = (changes.clock, &changes.places);
    let mut words = TextTable::default();
    let graphs = page.drawn();
    let graphs = graphs.map(|drawn| graph(page, drawn, places, clock, &mut words));
    let graphs = graphs.collect();
    let style = page.style;
    let lives = changes.lives.as_ref();
    let data = PageData {
        graphs,
        words: words.list(),
        starts: frames.iter().map(|f| clock.secs(f.span.start)).collect(),
        ends: frames.iter().map(|f| clock.secs(f.span.end)).collect(),
        epoch: clock.0.0.div_euclid(1_000_000),
        reported: &changes.windows,
        phases: phases(mission, clock),
        rows: lives.map_or_else(Vec::new, |lives| rows(lives, changes)),
        takeovers: lives.map_or_else(Vec::new, |lives| takeovers(lives, clock)),
        lives: last_signs(mission, changes),
        sizes: [
            style.edge.size.min(style.topic.small).min(style.node.small),
            style.topic.size,
            style.node.size,
            style.cluster.size,
        ],
        sides: whole.view.compares.then_some(SIDES),
        still,
        change: page.sequence.unfolded.map_or(0.25, |u| u.rate_change),
    };
    let mut json = serde_json::to_string(&data).unwrap_or_default();
    drop(data);
    // Whole seconds need no decimal point.
    for (from, to) in [(".0,", ","), (".0]", "]"), ("<", "\\u003c")] {
        json = json.replace(from, to);
    }
    json
}

fn graph<'a>(
    page: &HtmlPage<'_>,
    drawn: &'a PageGraph<'_>,
    places: &BTreeMap<Element, u32>,
    clock: PageClock,
    words: &mut TextTable,
) -> GraphData<'a> {
    let (view, runs) = (drawn.view, &drawn.runs);
    let order = || drawn.order.iter().map(|id| &view.arrows[*id]);
    let of_items = view.items.iter().map(|i| (&i.members, true));
    let of_arrows = order().map(|a| (&a.members, false));
    let all = of_items.chain(of_arrows);
    let facts = all.map(|(members, is_item)| facts_of(page, members, clock, is_item, words));
    let members = |item: &Item| -> Vec<u32> {
        let places = item.members.iter().filter_map(|m| places.get(m).copied());
        let places: BTreeSet<u32> = places.collect();
        places.into_iter().collect()
    };
    let arrow = |arrow: &Arrow| {
        let carried = match &arrow.kind {
            ArrowKind::Direct(topic) => visible(topic).into_owned(),
            _ => String::new(),
        };
        (arrow.from.0, arrow.to.0, carried)
    };
    let names = view.items.iter();
    let names = names.map(|item| visible(&item.name).into_owned());
    let of_lines = drawn.order.iter().map(|id| &runs.arrows[id.at()]);
    GraphData {
        facts: facts.collect(),
        names: names.collect(),
        kinds: view.items.iter().map(|i| i.kind as u8).collect(),
        boxes: drawn.union.items.iter().map(|p| rounded(p.rect)).collect(),
        arrows: order().map(arrow).collect(),
        classes: &runs.classes,
        labels: &runs.labels,
        runs: runs.items.iter().chain(of_lines).collect(),
        members: if std::ptr::eq(drawn, &raw const page.whole) {
            Vec::new()
        } else {
            view.items.iter().map(members).collect()
        },
    }
}

fn phases(mission: &Mission, clock: PageClock) -> Vec<(f64, f64, String)> {
    let all = &mission.log.phases;
    let phases = all.iter().filter(|_| all.len() > 1).map(|p| {
        let name = visible(&p.name).into_owned();
        // Of windows, one begins just after the last instant of the one before.
        let start = clock.secs(p.span.start.plus(1));
        (start, clock.secs(p.span.end), name)
    });
    phases.collect()
}

fn rows(timeline: &Timeline, changes: &PageChanges) -> Vec<RowData> {
    let clock = changes.clock;
    let row = |row: &Row| {
        let place = row.what().and_then(|what| changes.places.get(&what));
        let is_inferred = f64::from(u8::from(row.is_inferred));
        let lives = row.lives.iter();
        let lives =
            lives.flat_map(|life| [clock.secs(life.start), clock.secs(life.end), is_inferred]);
        let marks = row.marks.iter().filter_map(|mark| {
            let sign = match mark.sign {
                Sign::Start => 0,
                Sign::End => 1,
                Sign::Dot | Sign::Letter => 2,
                Sign::Handover => return None,
            };
            Some((clock.secs(mark.at), sign, *mark.events.first()?))
        });
        let bars = row.bars.iter().flat_map(|bar| {
            let ninths = libm::round(bar.share * 9.0).max(1.0);
            [clock.secs(bar.span.start), clock.secs(bar.span.end), ninths]
        });
        RowData(
            place.map_or(-1, |at| i64::from(*at)),
            visible(&row.labels.join(", ")).into_owned(),
            u8::from(row.level == Level::Inside),
            lives.collect(),
            bars.collect(),
            marks.collect(),
        )
    };
    timeline.rows.iter().map(row).collect()
}

fn takeovers(timeline: &Timeline, clock: PageClock) -> Vec<(f64, usize, usize, EventId)> {
    let marks = timeline.marks().into_iter();
    let takeover = |(to, mark): (usize, &RowMark)| {
        let from = timeline.giver(mark)?;
        Some((clock.secs(mark.at), from, to, *mark.events.first()?))
    };
    marks.filter_map(takeover).collect()
}

/// The most texts of a lifetime: they are read in a card beside the graph.
const MOST_TEXTS: usize = 3;

fn last_signs(mission: &Mission, changes: &PageChanges) -> Vec<(u32, Vec<LastSigns>)> {
    let (elements, clock) = (&mission.elements, changes.clock);
    let topic = |id| elements.topics.get(id).map_or("", |t| t.name.as_str());
    let senders = mission.sending.senders.iter();
    let senders = senders.filter(|s| !is_log(topic(s.topic)));
    let senders = grouped(senders.filter_map(|s| Some((s.node?, s))));
    let texts = grouped(mission.logged.iter().rev().map(|t| (&*t.logger, t)));
    let of = |(id, node): (NodeId, &Node)| {
        let life = |life: &Span| {
            let last = |sender: &Sender| {
                let mut own = sender.stretches.iter().rev();
                let last = own.find(|s| life.contains(s.first))?.last;
                Some((clock.secs(last), visible(topic(sender.topic)).into_owned()))
            };
            let own = senders.get(&id).into_iter().flatten();
            let last = own
                .filter_map(|s| last(s))
                .max_by(|a, b| a.0.total_cmp(&b.0));
            let own = texts.get(node.name.as_str()).into_iter().flatten();
            let texts = own.filter(|t| life.contains(t.time));
            let texts = texts.map(|t| (clock.secs(t.time), visible(&t.text).into_owned()));
            let (start, end) = (clock.secs(life.start), clock.secs(life.end));
            LastSigns(start, end, last, texts.take(MOST_TEXTS).collect())
        };
        let place = changes.places.get(&Element::Node(id))?;
        Some((*place, node.seen.lives.iter().map(life).collect()))
    };
    elements.nodes.with_ids().filter_map(of).collect()
}

/// The text for the page and its type.
pub(super) fn packed(json: &str) -> (String, &'static str) {
    if json.len() < LONG {
        return (json.to_owned(), "application/json");
    }
    let packed = digest::zlib(json.as_bytes(), 7);
    // The DEFLATE stream inside, which every browser can decompress.
    let bare = packed.get(2..packed.len() - 4).unwrap_or_default();
    let mut text = String::new();
    digest::base64(&mut text, bare);
    (text, "deflated")
}

fn rounded(rect: Rect) -> [i64; 4] {
    let whole = |v: f64| cast::to_i64(libm::round(v.clamp(-1e7, 1e7)));
    [whole(rect.x), whole(rect.y), whole(rect.w), whole(rect.h)]
}

/// The most members that are listed; the rest is counted.
const MOST_MEMBERS: usize = 12;

fn facts_of(
    page: &HtmlPage<'_>,
    members: &[Element],
    clock: PageClock,
    is_item: bool,
    words: &mut TextTable,
) -> Vec<u32> {
    let elements = &page.sequence.mission.elements;
    let mut facts = Vec::new();
    if let (true, [Element::Topic(_), ..]) = (is_item, members) {
        facts.extend(types(elements, members));
    }
    let evidence = members.iter().map(|m| elements.evidence(*m));
    let evidence = evidence.fold(Evidence::NONE, Evidence::and);
    let is_ros1 = is_ros1(page.sequence.mission).unwrap_or(false);
    facts.extend(evidence.lines().map(|line| known_by(&line, is_ros1)));
    if is_item {
        let lives = members.iter().map(|m| elements.seen(*m));
        let first = lives.clone().filter_map(|l| l.first).min();
        let last = lives.filter_map(|l| l.last).max();
        if let (Some(first), Some(last)) = (first, last) {
            let at = |t: Stamp| words::offset_seconds(t.since(clock.0));
            facts.push(format!("seen {} – {}", at(first), at(last)));
        }
        if members.len() > 1 {
            let names = members.iter().filter_map(|m| match elements.names(*m) {
                (Some(_), Some(_)) => None,
                (node, topic) => node.or(topic),
            });
            let mut names: Vec<&str> = names.take(MOST_MEMBERS + 1).collect();
            let rest = members.len().saturating_sub(MOST_MEMBERS);
            names.truncate(MOST_MEMBERS);
            let (many, names) = (members.len(), names.join(", "));
            let more = (rest > 0).then(|| format!(" and {rest} more"));
            let more = more.unwrap_or_default();
            facts.push(format!("{many} together: {names}{more}"));
        }
    }
    let facts = facts.into_iter();
    facts
        .map(|f| words.place(visible(&f).into_owned()))
        .collect()
}

/// The line about a kind of evidence, in words that suit the format of the recording.
fn known_by(line: &str, is_ros1: bool) -> String {
    match line.split_once(": ") {
        Some(("connection", _)) if !is_ros1 => {
            "known by connection: channels of the recording".to_owned()
        }
        Some(("unknown", about)) => format!("name unknown: {about}"),
        _ => format!("known by {line}"),
    }
}

/// The types of topics, and the quality of service with which they are offered.
fn types(elements: &Elements, members: &[Element]) -> Vec<String> {
    let mut topics = members.iter().filter_map(|what| match what {
        Element::Topic(id) => elements.topics.get(*id),
        _ => None,
    });
    let types = topics.clone().flat_map(|t| t.types.iter());
    let types: BTreeSet<&str> = types.map(|t| &**t).collect();
    let types: Vec<&str> = types.into_iter().collect();
    let qos = topics.find_map(|t| t.qos.as_deref());
    let mut facts = vec![format!("type {}", types.join(", "))];
    facts.extend(qos.map(|q| format!("quality of service {q}")));
    facts
}

// A mission as data for a page: per element a flat list of its values and the windows from which they apply,
// so that any window is found by one search.

/// The values of one item or arrow over the windows (indices into [`View::frames`]); before its first run a list has
/// value 0.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub(crate) struct ElementRuns {
    /// Its class words: indices into [`ViewRuns::classes`].
    pub classes: Runs<u32>,
    /// Its rate: indices into [`ViewRuns::labels`]. While it is absent, the last value stays.
    pub rates: Runs<u32>,
    /// Its lifecycle state: indices into [`ViewRuns::labels`]. While it is absent, the last value stays.
    pub lifecycles: Runs<u32>,
    /// Windows in which its rate changed, each with the old and the new rate: indices into [`ViewRuns::labels`].
    /// Such a value applies to one window.
    pub turns: Runs<u32>,
    /// Its messages per second in each window, as decimal numbers: indices into [`ViewRuns::labels`]. While it is absent,
    /// the last value stays.
    pub hertz: Runs<u32>,
}

/// The whole sequence of a view as runs.
pub(crate) struct ViewRuns {
    /// Class words separated by blanks, such as `active`, `active stated added w3`; the first is `off`:
    /// absent.
    pub classes: Vec<String>,
    /// Rates and lifecycle states as they are written, and rates as numbers; the first is empty: unknown.
    pub labels: Vec<String>,
    /// The values of each item of the view.
    pub items: Vec<ElementRuns>,
    /// The values of each arrow of the view.
    pub arrows: Vec<ElementRuns>,
}

impl ViewRuns {
    /// The runs of a view. `label` writes the rate of an element in a window, and the topics that an arrow carries;
    /// empty for none.
    pub(crate) fn of(view: &View, label: impl Fn(&Shown, Option<&Arrow>) -> String) -> Self {
        let (mut classes, mut labels) = (TextTable::default(), TextTable::default());
        classes.place("off".to_owned());
        labels.place(String::new());
        let mut runs = |all: &[ShownRuns], arrows| {
            let mut recorder = RunRecorder {
                classes: &mut classes,
                labels: &mut labels,
                label: &label,
                arrows,
            };
            let runs = all.iter().map(|looks| recorder.runs(looks));
            runs.collect::<Vec<_>>()
        };
        let items = runs(&view.items_shown, None);
        let arrows = runs(&view.arrows_shown, Some(&view.arrows));
        Self {
            classes: classes.list(),
            labels: labels.list(),
            items,
            arrows,
        }
    }

    /// The look of an element in a window.
    pub(crate) fn look(&self, life: &ElementRuns, window: u32) -> ElementLook<'_> {
        let lists = [&life.lifecycles, &life.rates];
        let list = lists[usize::from(lists[0].0.is_empty())];
        ElementLook {
            class: &self.classes[life.classes.at(window).unwrap_or(0) as usize],
            text: &self.labels[list.at(window).unwrap_or(0) as usize],
        }
    }

    /// All class words that occur.
    pub(crate) fn words(&self) -> BTreeSet<&str> {
        let classes = self.classes.iter();
        classes.flat_map(|class| class.split(' ')).collect()
    }
}

/// The class words of an element in a window, those of an arrow with the step of its thickness.
fn class(shown: &Shown, is_arrow: bool) -> String {
    let mut words = vec![shown.state.word()];
    words.extend((shown.confidence != Confidence::Measured).then(|| shown.confidence.word()));
    if let Some(mark) = shown.mark {
        words.push(mark.class());
        words.extend((mark.class() == "changed").then(|| mark.badge()));
    }
    words.extend(shown.is_starved.then_some("starved"));
    let step = Some(shown.width_step()).filter(|step| is_arrow && *step > 0);
    let step = step.map(|step| format!("w{step}"));
    words.extend(step.as_deref());
    words.join(" ")
}

/// Distinct texts in order of appearance.
#[derive(Default)]
struct TextTable(BTreeMap<String, u32>);

impl TextTable {
    fn place(&mut self, text: String) -> u32 {
        let next = u32::try_from(self.0.len()).unwrap_or(u32::MAX);
        *self.0.entry(text).or_insert(next)
    }

    fn list(self) -> Vec<String> {
        let mut out = vec![String::new(); self.0.len()];
        for (text, place) in self.0 {
            out[place as usize] = text;
        }
        out
    }
}

/// A writer of the values of the items, or of the arrows.
struct RunRecorder<'a, F> {
    classes: &'a mut TextTable,
    labels: &'a mut TextTable,
    label: F,
    arrows: Option<&'a [Arrow]>,
}

impl<F: Fn(&Shown, Option<&Arrow>) -> String> RunRecorder<'_, F> {
    fn runs(&mut self, looks: &ShownRuns) -> ElementRuns {
        let mut life = ElementRuns::default();
        // The text of each rate is cached: formatting takes time, and most rates recur.
        let mut known: BTreeMap<_, u32> = BTreeMap::new();
        let mut numbers: BTreeMap<_, u32> = BTreeMap::new();
        let mut last_hz = None;
        for (window, shown) in looks.runs() {
            let Some(shown) = shown else {
                life.classes.push(window, 0, 0);
                continue;
            };
            let arrow = self.arrows.and_then(|all| all.get(shown.id as usize));
            let class = self.classes.place(class(shown, arrow.is_some()));
            life.classes.push(window, class, 0);
            let each = shown.hz.map(|hz| hz / shown.each.max(1) as f64);
            let number = *numbers.entry(each.map(f64::to_bits)).or_insert_with(|| {
                let text = each.map(|hz| words::significant(hz, 6).to_string());
                self.labels.place(text.unwrap_or_default())
            });
            life.hertz.push(window, number, 0);
            if shown.mark == Some(Mark::Removed) {
                continue;
            }
            let (hz, count) = shown.written_rate();
            let hz = (hz.is_some() || count.is_some_and(|n| n > 0)).then(|| {
                let rows: Vec<_> = shown.topics.iter().map(TopicRow::key).collect();
                (hz.map(f64::to_bits), count, shown.each, rows)
            });
            if hz != last_hz || (life.rates.0.is_empty() && arrow.is_some()) {
                last_hz.clone_from(&hz);
                let place = known.entry(hz).or_insert_with(|| {
                    let text = (self.label)(shown, arrow);
                    self.labels.place(text)
                });
                life.rates.push(window, *place, 0);
            }
            if shown.has_new_rate() {
                let value = self.labels.place(words::rates(&shown.steps));
                life.turns.0.push((window, value));
            }
            let members = shown.members.number();
            let members = members.map(|(n, word)| words::count(n, word));
            let lifecycle = shown.lifecycle.as_deref().or(members.as_deref());
            let lifecycle = lifecycle.unwrap_or_default();
            if !lifecycle.is_empty() || !life.lifecycles.0.is_empty() {
                let place = self.labels.place(lifecycle.to_owned());
                life.lifecycles.push(window, place, 0);
            }
        }
        life
    }
}

impl Serialize for ElementRuns {
    /// `[classes, rates, lifecycles, turns, hertz]`, each [flat](Runs::flat); empty lists at the end are left out.
    fn serialize<S: Serializer>(&self, to: S) -> Result<S::Ok, S::Error> {
        let lists = [
            &self.classes,
            &self.rates,
            &self.lifecycles,
            &self.turns,
            &self.hertz,
        ];
        let reported = lists.iter().rposition(|list| !list.0.is_empty());
        let lists = &lists[..reported.map_or(0, |last| last + 1)];
        let all: Vec<Vec<u32>> = lists.iter().map(|list| list.flat()).collect();
        all.serialize(to)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::graph::{ById, State};
    use crate::view::{ArrowKind, ItemId};

    /// One element over the windows: present with this mark and rate, or absent.
    type Story<'a> = &'a [Option<(Option<Mark>, f64)>];

    fn runs(story: Story<'_>) -> ViewRuns {
        let shown = |there: &Option<(Option<Mark>, f64)>| {
            there.map(|(mark, hz)| Shown {
                mark,
                hz: Some(hz),
                steady_hz: Some(hz),
                ..Shown::plain(0, State::Active, Confidence::Measured)
            })
        };
        let story: Vec<_> = story.iter().map(shown).collect();
        let view = View {
            arrows: ById::from(vec![Arrow {
                from: ItemId(0),
                to: ItemId(0),
                kind: ArrowKind::Publish,
                members: Vec::new(),
                topics: Vec::new(),
                is_service: false,
            }]),
            arrows_shown: vec![ShownRuns::of(story.iter().map(Option::as_ref))].into(),
            ..View::default()
        };
        ViewRuns::of(&view, |shown, _| format!("{:.0}", shown.hz.unwrap_or(0.0)))
    }

    fn reported(runs: &ViewRuns, windows: u32) -> Vec<(&str, &str)> {
        let life = &runs.arrows[0];
        let add = |w| {
            let class = &runs.classes[life.classes.at(w).unwrap_or(0) as usize];
            let label = &runs.labels[life.rates.at(w).unwrap_or(0) as usize];
            (class.as_str(), label.as_str())
        };
        (0..windows).map(add).collect()
    }

    #[test]
    fn every_window_can_be_looked_up() {
        let added = Some((Some(Mark::Added), 10.0));
        let removed = Some((Some(Mark::Removed), 0.0));
        let runs = runs(&[
            None,
            added,
            Some((None, 10.0)),
            Some((None, 0.0)),
            removed,
            None,
        ]);
        let expected = [
            ("off", ""),
            ("active added w2", "10"),
            ("active w2", "10"),
            ("active", "0"),
            ("active removed", "0"),
            ("off", "0"),
        ];
        assert_eq!(reported(&runs, 6), expected);
    }

    #[test]
    fn constant_states_are_one_run() {
        let runs = runs(&[Some((None, 9.8)); 50]);
        assert_eq!(
            serde_json::to_string(&runs.arrows).unwrap(),
            "[[[0,1],[0,2],[],[],[0,1]]]"
        );
        assert_eq!(reported(&runs, 50)[49], ("active w2", "10"));
    }

    #[test]
    fn equal_rates_may_be_written_differently() {
        let shown = |held: Option<f64>| Shown {
            hz: Some(0.0),
            held: held.map(|hz| (hz, None)),
            ..Shown::plain(0, State::Active, Confidence::Measured)
        };
        let story = [shown(Some(7.1)), shown(None), shown(Some(7.1))];
        let view = View {
            items_shown: vec![ShownRuns::of(story.iter().map(Some))].into(),
            ..View::default()
        };
        let label = |shown: &Shown, _: Option<&Arrow>| {
            format!("{:.1}", shown.written_rate().0.unwrap_or(0.0))
        };
        let runs = ViewRuns::of(&view, label);
        let text = |list: &Runs<u32>, w| &*runs.labels[list.at(w).unwrap_or(0) as usize];
        let [item] = &runs.items[..] else { panic!() };
        assert_eq!(
            [0, 1, 2].map(|w| text(&item.rates, w)),
            ["7.1", "0.0", "7.1"]
        );
        assert_eq!([0, 1, 2].map(|w| text(&item.hertz, w)), ["0", "0", "0"]);
    }
}
