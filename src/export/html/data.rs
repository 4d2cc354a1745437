//! What the script of a page is given: names, facts and runs as JSON, deflated where that is long.

use std::collections::BTreeMap;
use std::io::Write as _;

// A stream of DEFLATE, which every browser unpacks by itself.
use flate2::{Compression, write::DeflateEncoder};
use serde::Serialize;

use super::{HtmlPage, PageGraph};
use crate::base::digest;
use crate::base::geometry::Rect;
use crate::base::time::Stamp;
use crate::base::words;
use crate::base::words::visible;
use crate::draw::figure::course::{LifeLine, LifeLines};
use crate::draw::picture::chips;
use crate::draw::picture::title::SIDES;
use crate::evidence::Evidence;
use crate::graph::{Element, Elements};
use crate::mission::Mission;
use crate::mission::events::sentence_with;
use crate::mission::ledger::Kind;
use crate::view::runs::ElementRuns;
use crate::view::{Arrow, ArrowKind, Frame, Item};

/// From this many bytes on, data is deflated.
const LONG: usize = 1_000_000;

/// What the script is given. This is the one place that says so; `player/data.js` reads it.
///
/// Times are seconds since the start of the first window. An *element* is a number: items first, then arrows in the
/// order in which they are painted, both of the graph with everything one by one unless said otherwise. A *run list*
/// is `[windows since the run before, value, …]`; a value holds until the next.
#[derive(Serialize)]
struct PageData<'a> {
    /// Everything one by one; then the picture, if that draws several as one.
    graphs: Vec<GraphData<'a>>,
    /// Sentences that `facts` point at.
    words: Vec<String>,
    /// Of each window, its start and its end.
    starts: Vec<f64>,
    ends: Vec<f64>,
    /// Milliseconds since 1970 at the start of the first window, and the date.
    epoch: i64,
    date: String,
    /// Of each window with headlines: what they say.
    told: Vec<ToldData>,
    /// Start, end and name of each phase.
    phases: Vec<(f64, f64, String)>,
    /// The life lines, from top to bottom.
    rows: Vec<RowData>,
    /// Hand-overs: when, and from which row to which.
    hands: Vec<(f64, usize, usize)>,
    /// Font sizes: of rates, topics' names, nodes' names, namespaces' titles.
    sizes: [f64; 4],
    /// What each window shows, where two missions are compared; absent otherwise.
    #[serde(skip_serializing_if = "Option::is_none")]
    sides: Option<[&'static str; 2]>,
    /// The window to begin with.
    still: usize,
    /// From which relative change of a rate on it is told.
    change: f64,
}

/// A graph.
#[derive(Serialize)]
struct GraphData<'a> {
    /// Per item.
    names: Vec<String>,
    /// Per item: 0 node, 1 topic, 2 group of topics, 3 namespace.
    kinds: Vec<u8>,
    /// Per item: x, y, width, height.
    boxes: Vec<[i64; 4]>,
    /// Per arrow: its ends, and the topic that it carries from node to node.
    arrows: Vec<(u32, u32, String)>,
    /// Per element: places in `words`.
    facts: Vec<Vec<u32>>,
    /// Class words of values of run lists.
    classes: &'a [String],
    /// Rates and lifecycle states, and changes of rates, as they are written.
    labels: &'a [String],
    /// Per element, run lists: of classes, of rates, of lifecycle states, and of changes of rates, whose values hold
    /// for one window. Empty lists at the end are left out.
    lives: Vec<&'a ElementRuns>,
    /// Per item of the picture: which items it stands for.
    holds: Vec<Vec<u32>>,
}

/// What a window tells: its place, how many headlines there are, the words of the three chips, and of the first
/// [`MOST_TOLD`] when, which sign (0 came, 1 went, 2 changed), of which element (-1 of none that is drawn), what.
#[derive(Serialize)]
struct ToldData(usize, usize, [String; 3], Vec<(f64, u8, i64, String)>);

/// A life line: its element (-1 for a namespace's title), its name, 1 below such a title, its lives as
/// `[start, end, flags, …]` (1 it began, 2 it ended, 4 by inference only), and when it sent as
/// `[start, end, ninths of its highest rate, …]`.
#[derive(Serialize)]
struct RowData(i64, String, u8, Vec<f64>, Vec<f64>);

/// So many headlines of one window are written out.
const MOST_TOLD: usize = 200;

/// The data as JSON that is safe between the tags of a page.
pub(super) fn json(page: &HtmlPage<'_>, still: usize) -> String {
    let whole = &page.whole;
    let mission = page.sequence.mission;
    let frames = &whole.view.frames;
    let clock = PageClock(frames.first().map_or(Stamp(0), |f| f.span.start));
    let places = places(whole);
    let mut words = Words::default();
    let mut graphs = vec![graph(page, whole, &places, clock, &mut words)];
    graphs.extend(
        page.folded
            .as_ref()
            .map(|folded| graph(page, folded, &places, clock, &mut words)),
    );
    let style = page.style;
    let lives = page.sequence.unfolded.and_then(|u| u.lives);
    let data = PageData {
        graphs,
        words: words.list,
        starts: frames.iter().map(|f| clock.secs(f.span.start)).collect(),
        ends: frames.iter().map(|f| clock.secs(f.span.end)).collect(),
        epoch: clock.0.0.div_euclid(1_000_000),
        date: words::date(clock.0.0),
        told: told(page, &places, clock),
        phases: phases(mission, clock),
        rows: lives.map_or_else(Vec::new, |lives| rows(lives, &places, clock)),
        hands: lives.map_or_else(Vec::new, |lives| {
            let hands = lives.handovers.iter();
            hands.map(|(at, a, b)| (clock.secs(*at), *a, *b)).collect()
        }),
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
    let json = serde_json::to_string(&data).unwrap_or_default();
    // A number of whole seconds needs no point.
    json.replace(".0,", ",")
        .replace(".0]", "]")
        .replace('<', "\\u003c")
}

/// Seconds since a moment.
#[derive(Clone, Copy)]
struct PageClock(Stamp);

impl PageClock {
    /// Whole milliseconds, rounded down, as everywhere.
    fn secs(self, at: Stamp) -> f64 {
        at.since(self.0).div_euclid(1_000_000) as f64 / 1e3
    }
}

/// The element that stands for each node, topic and edge.
fn places(drawn: &PageGraph<'_>) -> BTreeMap<Element, u32> {
    let mut places = BTreeMap::new();
    let items = drawn.view.items.iter().map(|item| &item.members);
    let arrows = drawn.order.iter().map(|at| &drawn.view.arrows[*at].members);
    for (members, place) in items.chain(arrows).zip(0..) {
        for member in members {
            places.entry(*member).or_insert(place);
        }
    }
    places
}

fn graph<'a>(
    page: &HtmlPage<'_>,
    drawn: &'a PageGraph<'_>,
    places: &BTreeMap<Element, u32>,
    clock: PageClock,
    words: &mut Words,
) -> GraphData<'a> {
    let (view, runs) = (drawn.view, &drawn.runs);
    let order = || drawn.order.iter().map(|at| &view.arrows[*at]);
    let of_items = view.items.iter().map(|i| (&i.members, true));
    let of_arrows = order().map(|a| (&a.members, false));
    let facts = of_items
        .chain(of_arrows)
        .map(|(members, is_item)| facts_of(page, members, clock, is_item, words));
    let holds = |item: &Item| -> Vec<u32> {
        let members = item.members.iter().filter_map(|m| places.get(m).copied());
        members
            .collect::<std::collections::BTreeSet<u32>>()
            .into_iter()
            .collect()
    };
    let arrow = |arrow: &Arrow| {
        let carried = match &arrow.kind {
            ArrowKind::Direct(topic) => visible(topic).into_owned(),
            _ => String::new(),
        };
        (arrow.from, arrow.to, carried)
    };
    GraphData {
        facts: facts.collect(),
        names: view
            .items
            .iter()
            .map(|i| visible(&i.name).into_owned())
            .collect(),
        kinds: view.items.iter().map(|i| i.kind as u8).collect(),
        boxes: drawn.union.items.iter().map(|p| rounded(p.rect)).collect(),
        arrows: order().map(arrow).collect(),
        classes: &runs.classes,
        labels: &runs.labels,
        lives: runs
            .items
            .iter()
            .chain(drawn.order.iter().map(|at| &runs.arrows[*at]))
            .collect(),
        holds: if std::ptr::eq(drawn, &raw const page.whole) {
            Vec::new()
        } else {
            view.items.iter().map(holds).collect()
        },
    }
}

fn told(page: &HtmlPage<'_>, places: &BTreeMap<Element, u32>, clock: PageClock) -> Vec<ToldData> {
    let mission = page.sequence.mission;
    let frames = page.whole.view.frames.iter().enumerate();
    let frames = frames.filter(|(_, frame)| !frame.headlines.is_empty());
    let parts = mission.ledger.all_parts();
    let told = |(at, frame): (usize, &Frame)| {
        let chips = chips(&frame.counts).map(|(text, _)| text);
        let lines = frame
            .headlines
            .iter()
            .take(MOST_TOLD)
            .filter_map(|headline| {
                let entry = mission.ledger.entries.get(headline.entry as usize)?;
                let own = parts.get(&headline.entry).map_or(&[][..], |p| &p[..]);
                let what = places.get(&headline.what).map_or(-1, |at| i64::from(*at));
                let sentence = sentence_with(mission, own, entry);
                Some((clock.secs(entry.time), sign(entry.kind), what, sentence))
            });
        ToldData(at, frame.counts.total(), chips, lines.collect())
    };
    frames.map(told).collect()
}

fn sign(kind: Kind) -> u8 {
    match kind {
        Kind::Started | Kind::Appeared => 0,
        Kind::Stopped | Kind::Vanished => 1,
        _ => 2,
    }
}

fn phases(mission: &Mission, clock: PageClock) -> Vec<(f64, f64, String)> {
    let phases = mission.ledger.phases.iter();
    let all = phases.map(|p| {
        let name = visible(&p.name).into_owned();
        (clock.secs(p.span.start), clock.secs(p.span.end), name)
    });
    if mission.ledger.phases.len() > 1 {
        all.collect()
    } else {
        Vec::new()
    }
}

fn rows(lives: &LifeLines, places: &BTreeMap<Element, u32>, clock: PageClock) -> Vec<RowData> {
    let row = |line: &LifeLine| {
        let place = line.what.and_then(|what| places.get(&what));
        let lives = line.lives.iter().flat_map(|life| {
            let flags = [
                (life.begins, 1.0),
                (life.ends, 2.0),
                (life.is_inferred, 4.0),
            ];
            let flags = flags.iter().filter(|(is, _)| *is).map(|(_, n)| n).sum();
            [
                clock.secs(life.span.start),
                clock.secs(life.span.end),
                flags,
            ]
        });
        let bars = line.bars.iter().flat_map(|bar| {
            let ninths = libm::round(bar.share * 9.0).max(1.0);
            [clock.secs(bar.span.start), clock.secs(bar.span.end), ninths]
        });
        let label = visible(&line.label).into_owned();
        let place = place.map_or(-1, |at| i64::from(*at));
        RowData(
            place,
            label,
            u8::from(line.is_inside),
            lives.collect(),
            bars.collect(),
        )
    };
    lives.rows.iter().map(row).collect()
}

/// The text for the page and its type.
pub(super) fn packed(json: &str) -> (String, &'static str) {
    if json.len() < LONG {
        return (json.to_owned(), "application/json");
    }
    let mut deflater = DeflateEncoder::new(Vec::new(), Compression::new(7));
    let bytes = deflater
        .write_all(json.as_bytes())
        .and_then(|()| deflater.finish());
    let mut text = String::new();
    digest::base64(&mut text, &bytes.unwrap_or_default());
    (text, "deflated")
}

fn rounded(rect: Rect) -> [i64; 4] {
    #[expect(clippy::cast_possible_truncation, reason = "pixels of a layout")]
    let whole = |v: f64| libm::round(v.clamp(-1e7, 1e7)) as i64;
    [whole(rect.x), whole(rect.y), whole(rect.w), whole(rect.h)]
}

/// Sentences, each once.
#[derive(Default)]
struct Words {
    list: Vec<String>,
    places: BTreeMap<String, u32>,
}

impl Words {
    fn place(&mut self, text: String) -> u32 {
        if let Some(place) = self.places.get(&text) {
            return *place;
        }
        let place = u32::try_from(self.list.len()).unwrap_or(u32::MAX);
        self.list.push(text.clone());
        self.places.insert(text, place);
        place
    }
}

/// More members than this are counted.
const MOST_MEMBERS: usize = 12;

fn facts_of(
    page: &HtmlPage<'_>,
    members: &[Element],
    clock: PageClock,
    is_item: bool,
    words: &mut Words,
) -> Vec<u32> {
    let elements = &page.sequence.mission.elements;
    let mut facts = Vec::new();
    if let (true, [Element::Topic(_), ..]) = (is_item, members) {
        facts.extend(types(elements, members));
    }
    let proof = members
        .iter()
        .fold(Evidence::NONE, |all, m| all.and(elements.evidence(*m)));
    facts.extend(proof.lines().map(|line| format!("known by {line}")));
    if is_item {
        let lives = members.iter().map(|m| elements.life(*m));
        let first = lives.clone().filter_map(|l| l.0).min();
        let last = lives.filter_map(|l| l.1).max();
        if let (Some(first), Some(last)) = (first, last) {
            let at = |t: Stamp| words::offset_seconds(t.since(clock.0));
            facts.push(format!("seen {} – {}", at(first), at(last)));
        }
        if members.len() > 1 {
            let names = members.iter().filter_map(|m| name(elements, *m));
            let mut names: Vec<&str> = names.take(MOST_MEMBERS + 1).collect();
            let rest = members.len().saturating_sub(MOST_MEMBERS);
            names.truncate(MOST_MEMBERS);
            let more = if rest > 0 {
                format!(" and {rest} more")
            } else {
                String::new()
            };
            facts.push(format!(
                "{} together: {}{more}",
                members.len(),
                names.join(", ")
            ));
        }
    }
    facts
        .into_iter()
        .map(|f| words.place(visible(&f).into_owned()))
        .collect()
}

/// Of topics: their types, and with which quality of service they are offered.
fn types(elements: &Elements, members: &[Element]) -> Vec<String> {
    let mut topics = members.iter().filter_map(|m| topic(elements, *m));
    let types = topics.clone().flat_map(|t| t.types.iter());
    let types: std::collections::BTreeSet<&str> = types.map(|t| &**t).collect();
    let types: Vec<&str> = types.into_iter().collect();
    let qos = topics.find_map(|t| t.qos.as_deref());
    let mut facts = vec![format!("type {}", types.join(", "))];
    facts.extend(qos.map(|q| format!("quality of service {q}")));
    facts
}

fn topic(elements: &Elements, element: Element) -> Option<&crate::graph::Topic> {
    match element {
        Element::Topic(id) => elements.topics.get(id as usize),
        _ => None,
    }
}

fn name(elements: &Elements, element: Element) -> Option<&str> {
    match element {
        Element::Node(id) => elements.nodes.get(id as usize).map(|n| n.name.as_str()),
        Element::Topic(id) => elements.topics.get(id as usize).map(|t| t.name.as_str()),
        Element::Publish(_) | Element::Subscribe(_) => None,
    }
}
