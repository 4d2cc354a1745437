//! The still: a mission in one window. Nothing in it changes, so everything that was ever there is drawn as it was
//! while it ran, with the times at which it was there.
//!
//! In a film, a node that ended in a window is drawn as ended. In a still of a mission of an hour, that would make
//! a planner that ran for 59 minutes grey.

use std::collections::{BTreeMap, BTreeSet};

use super::shown::Lengths;
use super::{
    Arrow, ArrowKind, Counts, Frame, Item, ItemId, Mark, Phrase, SeenWindow, Shown, ShownRuns,
    TopicRow, View, sum as added,
};
use crate::base::ids::grouped;
use crate::base::time::Span;
use crate::base::words;
use crate::graph::history::Sender;
use crate::graph::{ById, Element, State};
use crate::mission::event_log::{Event, Kind};
use crate::mission::rates::{Rates, are_close, same, steps};
use crate::mission::{EventId, Mission};

/// The times at which a box of a still was there.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Presence {
    /// When it was there, as parts of the mission's time, 0 to 1, sorted and disjoint.
    pub times: Vec<(f64, f64)>,
    /// Its starts, ends and restarts: [`Mark::Added`], [`Mark::Removed`] and [`Mark::Restarted`], sorted by time.
    pub marks: Vec<(f64, Mark)>,
}

/// All windows of a view as one.
pub(super) fn still(mut view: View, mission: &Mission) -> View {
    let lengths = Lengths::new(view.frames.iter().map(|f| f.span));
    let rates = StillRates(Rates::new(mission));
    let join = |looks: &mut ShownRuns, rated: &dyn Fn(Shown) -> Shown| {
        let shown = whole(looks, &lengths).map(rated);
        *looks = ShownRuns::of([shown.as_ref()]);
    };
    for row in &mut view.rows {
        join(&mut row.shown, &|shown| {
            if row.is_infrastructure {
                shown
            } else {
                rates.of_topics(&row.item.members, shown)
            }
        });
    }
    let also = view.also.iter_mut();
    let also = also.flat_map(|also| also.items.iter().zip(&mut also.shown));
    let items = view.items.iter().zip(view.items_shown.iter_mut());
    for (item, looks) in items.chain(also) {
        join(looks, &|shown| rates.of_topics(&item.members, shown));
    }
    for (arrow, looks) in view.arrows.iter().zip(view.arrows_shown.iter_mut()) {
        join(looks, &|shown| rates.of_line(arrow, shown));
    }
    let marks = marks(mission);
    let items = view.items.iter();
    let presences: ById<ItemId, Presence> =
        items.map(|item| presence(item, mission, &marks)).collect();
    if presences.iter().any(|presence| !presence.marks.is_empty()) {
        view.presences = presences;
    }
    let headlines = view.frames.iter_mut();
    let headlines: Vec<_> = headlines
        .flat_map(|f| std::mem::take(&mut f.headlines))
        .collect();
    let mut frame = Frame {
        messages: mission.messages,
        counts: Counts::of(&headlines),
        caption: headline(mission, words::count(roles(&view, mission), "node")),
        headlines,
        ..Frame::empty(0, mission.span)
    };
    if !view.presences.is_empty() {
        "under each node: when it ran; rates while sending".clone_into(&mut frame.note);
    }
    view.frames = vec![frame];
    view
}

/// The whole sequence as one window without marks: everything that ever existed, in its most active state,
/// with messages summed, and rates averaged over the windows from the first message to the last. `None` for a view without windows.
pub(crate) fn union(view: &View) -> Option<SeenWindow> {
    view.frames.first()?;
    let lengths = Lengths::new(view.frames.iter().map(|f| f.span));
    let all = |shown: &[ShownRuns]| {
        let whole = shown.iter().filter_map(|looks| whole(looks, &lengths));
        whole.collect()
    };
    Some(SeenWindow {
        items: all(&view.items_shown),
        arrows: all(&view.arrows_shown),
    })
}

/// The rates of a still: while a topic was sent, and their steps.
struct StillRates<'a>(Rates<'a>);

impl StillRates<'_> {
    /// The mean rate of some senders together while they send, and the rates in order if there are several. Too few
    /// messages have none. `hz`, the mean of the windows, stays if it is the same, or without any sender.
    fn rate(&self, senders: &[&Sender], hz: Option<f64>) -> (Option<f64>, Vec<f64>) {
        match self.0.while_sending(senders) {
            Some(mean) => {
                let hz = hz.filter(|hz| same(*hz, mean)).unwrap_or(mean);
                (Some(hz), steps(&self.0.of(senders)))
            }
            None => (hz.filter(|_| senders.is_empty()), Vec::new()),
        }
    }

    /// The look of a box or row of topics, with the rates of a single one, or of each of several with equal ones.
    fn of_topics(&self, members: &[Element], shown: Shown) -> Shown {
        let rates = |what: &Element| match what {
            Element::Topic(topic) if members.len() == 1 || shown.each > 0 => {
                let hz = shown.hz.filter(|_| members.len() == 1);
                Some(self.rate(&self.0.of_topic(*topic), hz))
            }
            _ => None,
        };
        let rates: Option<Vec<_>> = members.iter().map(rates).collect();
        let Some((first, others)) = rates.as_deref().and_then(<[_]>::split_first) else {
            return shown;
        };
        let all = |(hz, steps): &(Option<f64>, Vec<f64>)| -> Vec<f64> {
            hz.iter().chain(steps).copied().collect()
        };
        let (own, many) = (all(first), members.len());
        let are_equal = |other: Vec<f64>| {
            other.len() == own.len() && own.iter().zip(other).all(|(a, b)| are_close(*a, b))
        };
        if !others.iter().map(all).all(are_equal) {
            let (hz, each) = (None, 0);
            return Shown { hz, each, ..shown };
        }
        Shown {
            hz: first.0.map(|hz| hz * many as f64),
            each: if many > 1 { many } else { 0 },
            steps: first.1.clone(),
            ..shown
        }
    }

    /// The look of a line, with the rates of each topic on it.
    fn of_line(&self, arrow: &Arrow, mut shown: Shown) -> Shown {
        for row in &mut shown.topics {
            let name = arrow.topics.get(row.topic as usize).map(|name| &**name);
            let edges = self.0.publications(&arrow.members, name);
            (row.hz, row.steps) = self.rate(&self.0.senders(&edges), row.hz);
        }
        if arrow.kind == ArrowKind::Publish {
            let edges = self.0.publications(&arrow.members, None);
            if let [_] = edges[..] {
                (shown.hz, shown.steps) = self.rate(&self.0.senders(&edges), shown.hz);
            }
        }
        shown
    }
}

/// The look of one item or arrow in all windows together.
fn whole(looks: &ShownRuns, lengths: &Lengths) -> Option<Shown> {
    let mut slot = None;
    let (mut first, mut last) = (None, 0);
    for (from, to, _, shown) in looks.spans(lengths.windows()) {
        gather(&mut slot, shown, lengths.of(from, to), u64::from(to - from));
        if shown.hz.is_some_and(|hz| hz > 0.0) {
            (first, last) = (first.or(Some(from)), to);
        }
    }
    let time = first.map_or(0.0, |first| lengths.of(first, last));
    let average = |sum: f64| if time > 0.0 { sum / time } else { 0.0 };
    let sum: Shown = slot?;
    let hz = sum.hz.map(average).filter(|_| sum.state != State::Latched);
    // One message that is latched has no rate.
    let counted = |state, count: Option<u64>| count.filter(|_| state != State::Latched);
    let row = |row: TopicRow| TopicRow {
        hz: row.hz.map(average).filter(|_| row.state != State::Latched),
        count: counted(row.state, row.count),
        ..row
    };
    let topics = sum.topics.iter().cloned().map(row).collect();
    Some(Shown {
        topics,
        hz,
        steady_hz: hz,
        count: counted(sum.state, sum.count),
        ..sum
    })
}

/// Adds a look that applies to `windows` windows of `length` nanoseconds in total; rates become sums over
/// time.
fn gather(slot: &mut Option<Shown>, shown: &Shown, length: f64, windows: u64) {
    let count = shown.count.map(|count| count.saturating_mul(windows));
    let rows = shown.topics.iter().map(|row| TopicRow {
        hz: row.hz.map(|hz| hz * length),
        count: row.count.map(|count| count.saturating_mul(windows)),
        mark: None,
        steps: Vec::new(),
        ..row.clone()
    });
    let shown = Shown {
        unlined: Vec::new(),
        topics: rows.collect(),
        mark: None,
        sender: None,
        hz: shown.hz.map(|hz| hz * length),
        steps: Vec::new(),
        events: Vec::new(),
        inside: None,
        lifecycle: None,
        count,
        ..shown.clone()
    };
    let Some(sum) = slot else {
        *slot = Some(shown);
        return;
    };
    let states = [sum.state, shown.state];
    sum.add(&shown);
    sum.state = in_both(states, sum.count);
    for row in shown.topics {
        match sum.topics.binary_search_by_key(&row.topic, |r| r.topic) {
            Err(place) => sum.topics.insert(place, row),
            Ok(place) => add_row(&mut sum.topics[place], &row),
        }
    }
}

fn add_row(sum: &mut TopicRow, row: &TopicRow) {
    sum.ways = [sum.ways[0] | row.ways[0], sum.ways[1] | row.ways[1]];
    sum.is_starved &= row.is_starved;
    sum.hz = added(sum.hz, row.hz, |a, b| a + b);
    sum.count = added(sum.count, row.count, u64::saturating_add);
    sum.state = in_both([sum.state, row.state], sum.count);
}

/// The most active of two states; a single message that is latched stays so.
fn in_both(states: [State; 2], count: Option<u64>) -> State {
    let is_latched = states.contains(&State::Latched) && count <= Some(1);
    let single = is_latched.then_some(State::Latched);
    single.unwrap_or(states[0].min(states[1]))
}

/// Marks of nodes, each with its event, as parts of the mission's time.
type NodeMarks = BTreeMap<Element, Vec<(EventId, f64, Mark)>>;

/// The starts, ends and restarts of each node in the log, in its order.
fn marks(mission: &Mission) -> NodeMarks {
    let mark = |(id, event): (EventId, &Event)| {
        let mark = match event.kind {
            Kind::Started => Mark::Added,
            Kind::Stopped => Mark::Removed,
            Kind::Restarted => Mark::Restarted,
            _ => return None,
        };
        Some((event.what, (id, mission.span.part(event.time), mark)))
    };
    let events = mission.log.events.with_ids();
    let events = events.filter(|(_, event)| event.is_headline() && event.what.is_node());
    grouped(events.filter_map(mark))
}

/// The times of the nodes in a box; none for a box of topics.
fn presence(item: &Item, mission: &Mission, marks: &NodeMarks) -> Presence {
    let nodes = || item.members.iter().filter(|what| what.is_node());
    let lives = nodes().flat_map(|what| mission.elements.seen(*what).lives.iter().copied());
    let times = Span::joined(lives.collect(), 0);
    let parts = |life: &Span| {
        [life.start, life.end]
            .map(|at| mission.span.part(at))
            .into()
    };
    let own = nodes().filter_map(|what| marks.get(what));
    let mut own: Vec<_> = own.flatten().collect();
    own.sort_by_key(|(id, ..)| *id);
    Presence {
        times: times.iter().map(parts).collect(),
        marks: own.into_iter().map(|(_, at, mark)| (*at, *mark)).collect(),
    }
}

/// The number of nodes in boxes and in words; the runs of an anonymous node are one.
fn roles(view: &View, mission: &Mission) -> usize {
    let in_words = view.also.iter().flat_map(|also| &also.items);
    let members = view.items.iter();
    let members = members.chain(in_words).flat_map(|item| &item.members);
    let role = |what: &Element| match what {
        Element::Node(id) => mission.elements.nodes.get(*id).map(|node| &*node.role),
        _ => None,
    };
    members.filter_map(role).collect::<BTreeSet<&str>>().len()
}

/// The headline of a whole mission with so many elements: `31 nodes, 7 phases, 2 restarts, 2 topics change hands`.
pub(crate) fn headline(mission: &Mission, elements: String) -> Vec<Phrase> {
    let many = |kind: Kind| {
        let events = mission.log.headlines(mission.span);
        events.filter(|(_, event)| event.kind == kind).count()
    };
    let (phases, restarts) = (mission.log.phases.len(), many(Kind::Restarted));
    let hands = many(Kind::HandedOver);
    let change = if hands == 1 { "changes" } else { "change" };
    let topics = words::count(hands, "topic");
    let parts = [
        (true, elements),
        (phases > 1, words::count(phases, "phase")),
        (restarts > 0, words::count(restarts, "restart")),
        (hands > 0, format!("{topics} {change} hands")),
    ];
    let parts = parts.into_iter().filter(|(is_told, _)| *is_told);
    let parts: Vec<String> = parts.map(|(_, words)| words).collect();
    vec![Phrase {
        sign: ' ',
        lead: parts.join(", "),
        ..Phrase::default()
    }]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::view::testing::mission;
    use crate::view::{ViewOptions, view};

    #[test]
    fn a_still_says_the_rate_of_each_of_equal_topics_only_if_they_are_equal() {
        let robots = |hz: [u8; 4]| {
            let robot = |(n, hz)| format!("/r{n}/drive>/r{n}/odom@{hz} /r{n}/plan</r{n}/odom");
            (1..).zip(hz).map(robot).collect::<Vec<_>>().join(" ")
        };
        let said = |windows: &[[u8; 4]]| {
            let windows: Vec<String> = windows.iter().map(|hz| robots(*hz)).collect();
            let windows: Vec<&str> = windows.iter().map(String::as_str).collect();
            let options = ViewOptions {
                is_still: Some(true),
                ..ViewOptions::default()
            };
            let (seen, _) = view(&mission(&windows), &options);
            let mut items = seen.items.with_ids();
            let (odom, _) = items.find(|(_, i)| &*i.name == "/rN/odom").unwrap();
            let shown = seen.items_shown[odom].at(0).unwrap();
            (shown.each, shown.hz, shown.steps.clone())
        };
        assert_eq!(said(&[[2; 4], [2; 4]]), (4, Some(8.0), vec![]));
        let (each, _, steps) = said(&[[100; 4], [100; 4], [200; 4]]);
        assert_eq!((each, steps), (4, vec![100.0, 200.0]));
        // Of unequal rates, the sum is true.
        assert_eq!(said(&[[10, 20, 10, 20]; 2]), (0, Some(60.0), vec![]));
    }

    #[test]
    fn rates_are_averaged_from_the_first_message_to_the_last() {
        let (view, _) = view(
            &mission(&["/a>/t", "/a>/t@4", "/a", "/a>/t@5 /b", "/a"]),
            &ViewOptions::default(),
        );
        let all = union(&view).unwrap();
        assert_eq!((all.items.len(), all.arrows.len()), (3, 1));
        assert_eq!(
            (all.arrows[0].hz, all.arrows[0].count),
            (Some(3.0), Some(90))
        );
        assert!(all.items.iter().all(|s| s.mark.is_none()));
        assert!(union(&View::default()).is_none());
    }
}
