//! The mission as one sentence: its length, its nodes and topics, and when it changed most. All outputs that introduce a
//! mission begin with it.

use std::cmp::Reverse;

use super::{Info, TopicInfo};
use crate::base::cast;
use crate::base::ids::grouped;
use crate::base::name::{is_quiet, last_part, namespace};
use crate::base::notice::NoticeKind;
use crate::base::rhythm::CLOSE_NS;
use crate::base::words::{self, visible};
use crate::graph::Element;
use crate::mission::Mission;
use crate::mission::event_log::{
    Event, EventId, Kind, LogFormat, LogRow, row_lines, sentence_with,
};

/// The most moments in it: with four the sentence fills three lines of a page.
const MOST_MOMENTS: usize = 3;
/// The changes of a moment in it: what an eye takes in at once.
const MOMENT: Most = Most {
    kinds: 2,
    elements: 2,
};
/// The most characters of a moment, about two lines of a page; more are names of unusual length.
const LONGEST: usize = 240;

/// An event that is shown separately, with its id.
pub(crate) type Headline<'a> = (EventId, &'a Event);

/// The sentence, without a period at its end: `5 min 26 s: 36 nodes, 77 topics, 42 changes. 02:36 replanner, planner and 5
/// more of /robot1 stopped; 03:20 …`, or `35.8 s: 1 node, 1 topic at 10 Hz, nothing changed`.
pub(crate) fn summary(mission: &Mission, info: &Info) -> String {
    let log = &mission.log;
    let all = log.events.with_ids().filter(|(_, e)| e.is_headline());
    let all: Vec<Headline<'_>> = all.collect();
    if log.compares {
        return match all.len() {
            0 => "no difference".to_owned(),
            many => words::count(many, "difference") + ": " + &described(mission, &all, MOMENT),
        };
    }
    if mission.messages == 0 && all.is_empty() {
        return "no messages".to_owned();
    }
    let gaps = log.interruptions.iter().map(|one| {
        let lines = row_lines(mission, &[LogRow::Interruption(one)], LogFormat::Text);
        let words = lines.first().map_or("", |line| &line.words).to_owned();
        (one.time, words)
    });
    // Remarks on the recorder count only if there is nothing else.
    let changes = all.iter().copied().filter(|(_, e)| !e.kind.is_remark());
    let changes: Vec<Headline<'_>> = changes.collect();
    let changes = if changes.is_empty() { &all } else { &changes };
    let near = |a: &Headline<'_>, b: &Headline<'_>| b.1.time.since(a.1.time) <= CLOSE_NS;
    let mut moments: Vec<&[Headline<'_>]> = changes.chunk_by(near).collect();
    moments.sort_by_key(|moment| Reverse(weight(moment)));
    moments.truncate(MOST_MOMENTS);
    let timed = |m: &&[Headline<'_>]| (m[0].1.time, described(mission, m, MOMENT));
    let mut moments: Vec<_> = moments.iter().map(timed).chain(gaps.take(1)).collect();
    moments.sort();
    let moments = moments.into_iter().map(|(at, words)| {
        let at = words::offset_seconds(mission.offset(at));
        words::shorten(&format!("{at} {words}"), LONGEST).into_owned()
    });
    let moments = words::joined(moments, "; ");
    let counts = [
        (all.len(), "change"),
        (log.interruptions.len(), "interruption"),
    ];
    let many = match words::counted(&counts, words::count) {
        none if none.is_empty() => at_times(mission) + "nothing changed",
        some => some,
    };
    let is_apart = mission.notices.iter().any(|n| n.kind == NoticeKind::Apart);
    let first = format!("{}, {many}", contents(info, is_apart));
    if moments.is_empty() {
        return first;
    }
    format!("{first}. {moments}")
}

/// The topics whose first or last message shows no change, such as the last key that somebody presses: `/cmd_vel at times, `.
fn at_times(mission: &Mission) -> String {
    let topic = |event: &Event| mission.elements.names(event.what).1.unwrap_or_default();
    let own = mission.log.events.with_ids();
    let own = own.filter(|(_, e)| e.part_of.is_none() && e.what.is_topic() && !is_quiet(topic(e)));
    let mut own: Vec<Headline<'_>> = own.collect();
    own.sort_by_key(|(_, e)| e.what);
    own.dedup_by_key(|(_, e)| e.what);
    match names(mission, &own, MOMENT.elements) {
        names if own.is_empty() => names,
        names => names + " at times, ",
    }
}

/// The length, with recordings of several runs as such, the nodes and the topics with messages; the rate if there is only one.
fn contents(info: &Info, is_apart: bool) -> String {
    let topics: Vec<&TopicInfo> = info.topics.iter().filter(|t| t.count > 0).collect();
    let counts = [
        (info.nodes_by_degree.total(), "node"),
        (topics.len(), "topic"),
    ];
    let counts = words::counted(&counts, words::count);
    let rate = match topics[..] {
        [one] => one.hz.map(|hz| format!(" at {}", words::rate(hz))),
        _ => None,
    };
    let length = words::duration(cast::to_i64(info.duration_s * 1e9));
    let apart = Some(", recordings far apart").filter(|_| is_apart);
    let apart = apart.unwrap_or_default();
    format!("{length}{apart}: {counts}{}", rate.unwrap_or_default())
}

fn weight(headlines: &[Headline<'_>]) -> u32 {
    headlines.iter().map(|(_, e)| e.weight).sum()
}

/// The most kinds of changes in a description, and the most elements of each.
#[derive(Clone, Copy)]
pub(crate) struct Most {
    pub(crate) kinds: usize,
    pub(crate) elements: usize,
}

/// Some changes in words, the kinds with most elements first: `planner, controller and 5 more of /robot1 stopped, /plan appeared`.
pub(crate) fn described(mission: &Mission, headlines: &[Headline<'_>], most: Most) -> String {
    let is_edge = |what| matches!(what, Element::Publish(_) | Element::Subscribe(_));
    let kind = |(_, event): &Headline<'_>| (is_edge(event.what), event.kind);
    let kinds = grouped(headlines.iter().map(|one| (kind(one), *one)));
    let mut kinds: Vec<_> = kinds.into_iter().collect();
    kinds.sort_by_key(|(_, own)| Reverse(weight(own)));
    let words = kinds.iter().take(most.kinds).map(|((is_edge, kind), own)| {
        let is_life = matches!(
            kind,
            Kind::Started | Kind::Stopped | Kind::Appeared | Kind::Vanished
        );
        if *is_edge || !is_life {
            return of_the_log(mission, own, most.elements);
        }
        let names = names(mission, own, most.elements);
        format!("{names} {}", mission.log.word(*kind))
    });
    words::joined(words, ", ")
}

/// The names of some elements, of nodes their roles, without the namespace that all of them share.
fn names(mission: &Mission, headlines: &[Headline<'_>], most: usize) -> String {
    let elements = &mission.elements;
    let name = |(_, event): &Headline<'_>| match event.what {
        Element::Node(id) => visible(&elements.nodes[id].role).into_owned(),
        what => visible(elements.names(what).1.unwrap_or_default()).into_owned(),
    };
    let names: Vec<String> = headlines.iter().map(name).collect();
    // Instead of one more name "and 1 more" would be no shorter.
    let most = most + usize::from(names.len() == most + 1);
    let space = names.first().map_or("/", |name| namespace(name));
    if space == "/" || names.len() == 1 || names.iter().any(|name| namespace(name) != space) {
        return words::some_of(&names, most);
    }
    let short = names.iter().map(|name| last_part(name));
    format!("{} of {space}", words::some_of(short, most))
}

/// The log's sentences about the first of these, and the number of the others.
fn of_the_log(mission: &Mission, headlines: &[Headline<'_>], most: usize) -> String {
    // Two kinds in a moment leave space for one sentence each.
    let most = most - usize::from(most == MOMENT.elements);
    let said = headlines.iter();
    let said = said.map(|(_, event)| sentence_with(mission, &[], event));
    words::some_of(said, most)
}
