//! The data of a page: names, facts and runs as JSON, deflated where that is long.

use std::collections::BTreeMap;
use std::io::Write as _;

// A stream of DEFLATE, which every browser unpacks by itself.
use flate2::{Compression, write::DeflateEncoder};
use serde::Serialize;

use super::HtmlPage;
use crate::base::digest;
use crate::base::geometry::Rect;
use crate::base::time::Stamp;
use crate::base::words;
use crate::base::words::visible;
use crate::draw::picture::chips;
use crate::evidence::Evidence;
use crate::graph::{Element, Elements};
use crate::view::runs::{ElementRuns, Runs};
use crate::view::{Arrow, Frame, View};

/// From this many bytes on, data is deflated.
const LONG: usize = 1_000_000;

#[derive(Serialize)]
struct PageData<'a> {
    /// Per item.
    names: Vec<String>,
    /// Per item: x, y, width, height.
    boxes: Vec<[i64; 4]>,
    /// Per arrow, in the order in which they are painted: its ends.
    arrows: Vec<[u32; 2]>,
    /// Per item, then per arrow: places in `words`.
    facts: Vec<Vec<u32>>,
    words: Vec<String>,
    classes: &'a [String],
    labels: &'a [String],
    /// Per item, then per arrow.
    lives: Vec<&'a ElementRuns>,
    /// Of each window with headlines its place, how many there are, and the words of the three chips.
    told: Vec<(usize, usize, String, String, String)>,
    /// Seconds from the start of the first window to that of each.
    starts: Vec<f64>,
    /// To the end of the last.
    end: f64,
    /// Milliseconds since 1970 at the start of the first.
    epoch: i64,
}

/// The data as JSON that is safe between the tags of a page.
pub(super) fn json(page: &HtmlPage<'_>, runs: &Runs) -> String {
    let (view, order) = (page.view, &page.union.order);
    let start = view.frames.first().map_or(Stamp(0), |f| f.span.start);
    let secs = |at: Stamp| libm::round(at.since(start) as f64 / 1e6) / 1e3;
    let mut words = Words::default();
    let mut facts: Vec<Vec<u32>> = Vec::new();
    for item in &view.items {
        facts.push(facts_of(page, &item.members, start, true, &mut words));
    }
    for &at in order {
        facts.push(facts_of(
            page,
            &view.arrows[at].members,
            start,
            false,
            &mut words,
        ));
    }
    let ends = |arrow: &Arrow| [arrow.from, arrow.to];
    let data = PageData {
        names: view
            .items
            .iter()
            .map(|i| visible(&i.name).into_owned())
            .collect(),
        boxes: page
            .union
            .items
            .iter()
            .map(|part| rounded(part.rect))
            .collect(),
        arrows: order.iter().map(|at| ends(&view.arrows[*at])).collect(),
        facts,
        words: words.list,
        classes: &runs.classes,
        labels: &runs.labels,
        lives: runs
            .items
            .iter()
            .chain(order.iter().map(|at| &runs.arrows[*at]))
            .collect(),
        told: told(view),
        starts: view.frames.iter().map(|f| secs(f.span.start)).collect(),
        end: view.frames.last().map_or(0.0, |f| secs(f.span.end)),
        epoch: start.0.div_euclid(1_000_000),
    };
    let json = serde_json::to_string(&data).unwrap_or_default();
    // A number of whole seconds needs no point.
    json.replace(".0,", ",")
        .replace(".0]", "]")
        .replace('<', "\\u003c")
}

fn told(view: &View) -> Vec<(usize, usize, String, String, String)> {
    let frames = view.frames.iter().enumerate();
    let frames = frames.filter(|(_, frame)| !frame.headlines.is_empty());
    let told = |(at, frame): (usize, &Frame)| {
        let [came, went, changed] = chips(&frame.counts).map(|(text, _)| text);
        (at, frame.counts.total(), came, went, changed)
    };
    frames.map(told).collect()
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
    start: Stamp,
    is_item: bool,
    words: &mut Words,
) -> Vec<u32> {
    let elements = &page.mission.elements;
    let mut facts = Vec::new();
    if let (true, [Element::Topic(_), ..]) = (is_item, members) {
        let mut topics = members.iter().filter_map(|m| topic(elements, *m));
        let mut types: Vec<&str> = topics
            .clone()
            .flat_map(|t| t.types.iter().map(|t| &**t))
            .collect();
        types.sort_unstable();
        types.dedup();
        facts.push(format!("type {}", types.join(", ")));
        let qos: Option<&str> = topics.find_map(|t| t.qos.as_deref());
        facts.extend(qos.map(|q| format!("quality of service {q}")));
    }
    let proof = members
        .iter()
        .fold(Evidence::NONE, |all, m| all.and(evidence(elements, *m)));
    if !proof.is_empty() {
        facts.push(format!(
            "known by {}",
            proof.words().collect::<Vec<_>>().join(", ")
        ));
    }
    if is_item {
        let lives = members.iter().map(|m| elements.life(*m));
        let first = lives.clone().filter_map(|l| l.0).min();
        let last = lives.filter_map(|l| l.1).max();
        if let (Some(first), Some(last)) = (first, last) {
            let at = |t: Stamp| words::offset_seconds(t.since(start));
            facts.push(format!("seen {} – {}", at(first), at(last)));
        }
        if members.len() > 1 {
            let names = members.iter().filter_map(|m| name(elements, *m));
            let mut names: Vec<&str> = names.take(MOST_MEMBERS + 1).collect();
            if names.len() > MOST_MEMBERS {
                names[MOST_MEMBERS] = "…";
            }
            facts.push(format!("{} together: {}", members.len(), names.join(", ")));
        }
    }
    facts
        .into_iter()
        .map(|f| words.place(visible(&f).into_owned()))
        .collect()
}

fn topic(elements: &Elements, element: Element) -> Option<&crate::graph::Topic> {
    match element {
        Element::Topic(id) => elements.topics.get(id as usize),
        _ => None,
    }
}

fn evidence(elements: &Elements, element: Element) -> Evidence {
    match element {
        Element::Node(id) => elements.nodes.get(id as usize).map(|n| n.evidence),
        Element::Topic(id) => elements.topics.get(id as usize).map(|t| t.evidence),
        Element::Publish(id) => elements.publishes.get(id as usize).map(|e| e.evidence),
        Element::Subscribe(id) => elements.subscribes.get(id as usize).map(|e| e.evidence),
    }
    .unwrap_or(Evidence::NONE)
}

fn name(elements: &Elements, element: Element) -> Option<&str> {
    match element {
        Element::Node(id) => elements.nodes.get(id as usize).map(|n| n.name.as_str()),
        Element::Topic(id) => elements.topics.get(id as usize).map(|t| t.name.as_str()),
        Element::Publish(_) | Element::Subscribe(_) => None,
    }
}
