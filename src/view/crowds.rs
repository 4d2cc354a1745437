//! Windows with more changes than a reader can follow: changes of one kind in one namespace become one
//! coloured frame with their number, and a short phrase in the headline.

use std::collections::BTreeMap;

use super::{Frame, Mark, Phrase, SeenWindow, Shown, View};
use crate::base::name::lies_in;
use crate::graph::Element;
use crate::mission::Mission;
use crate::mission::event_log::{EventId, Kind};

/// The most changes that have their own colour and their own words in the headline.
const MOST: usize = 5;
/// The event of a phrase that describes several.
const FOLDED: EventId = EventId::MAX;
/// The word for publications and subscriptions.
const EDGES: &str = "edges";

/// The indices of a phrase in the headline and of a name in it.
type NamePlace = (usize, usize);

/// Changes of one kind in one namespace that are one coloured frame.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Crowd {
    /// The namespace with the frame: an index into [`View::namespaces`]; the whole graph if `None`.
    pub space: Option<usize>,
    /// Its colour.
    pub mark: Mark,
    /// The words on the frame: `+4 nodes`.
    pub words: String,
    /// The headlines, sorted: indices in the event log.
    pub events: Vec<EventId>,
}

/// Combines crowds in every window.
pub(super) fn gather(view: &mut View, mission: &Mission) {
    let mut frames = std::mem::take(&mut view.frames);
    for frame in &mut frames {
        let words = |frame: &Frame| frame.caption.iter().map(|p| p.names.len()).sum::<usize>();
        while words(frame) > MOST {
            let Some((names, space)) = largest(frame, view, mission) else {
                break;
            };
            fold(frame, &names, space, view, mission);
        }
    }
    view.frames = frames;
}

/// The largest group of names of one kind in one namespace, or anywhere, and the innermost namespace around all of them.
fn largest(
    frame: &Frame,
    view: &View,
    mission: &Mission,
) -> Option<(Vec<NamePlace>, Option<usize>)> {
    let mut groups: BTreeMap<(bool, usize, usize), Vec<NamePlace>> = BTreeMap::new();
    // The first phrase about edges that appear, and about those that vanish.
    let mut edges: BTreeMap<char, usize> = BTreeMap::new();
    let phrases = frame.caption.iter().zip(0..);
    let names =
        phrases.flat_map(|(phrase, at)| phrase.events.iter().zip(0..).map(move |e| (at, e)));
    for (at, (event, name)) in names.filter(|(_, (event, _))| **event != FOLDED) {
        let kind = match noun(mission, *event) {
            EDGES => *edges.entry(frame.caption[at].sign).or_insert(at),
            _ => at,
        };
        let outermost = around(view, subject(mission, *event)).first().copied();
        // The whole graph comes after all namespaces.
        let framed = outermost.map(|space| (true, kind, space));
        for key in framed.into_iter().chain([(false, kind, usize::MAX)]) {
            groups.entry(key).or_default().push((at, name));
        }
    }
    groups.retain(|_, names| names.len() > 1);
    let all: usize = frame.caption.iter().map(|p| p.names.len()).sum();
    let best = groups
        .into_iter()
        .max_by_key(|((is_framed, at, space), names)| {
            // New elements are still visible in the next window; elements that ended are visible in this one
            // only.
            let stays = frame.caption[*at].sign == '+' && all - names.len() < MOST;
            let order = (usize::MAX - at, usize::MAX - space);
            (*is_framed, stays, names.len(), order)
        });
    let (_, names) = best?;
    let spaces = names
        .iter()
        .map(|(at, name)| around(view, subject(mission, frame.caption[*at].events[*name])));
    let common = spaces.reduce(|a, b| {
        let same = a.into_iter().zip(b).take_while(|(a, b)| a == b);
        same.map(|(a, _)| a).collect()
    });
    Some((names, common.and_then(|all| all.last().copied())))
}

/// The namespaces with a frame around a name, the outermost first.
fn around(view: &View, name: &str) -> Vec<usize> {
    let spaces = view.namespaces.iter().enumerate();
    spaces
        .filter(|(_, space)| lies_in(name, &space.name))
        .map(|(at, _)| at)
        .collect()
}

/// The node that an event is about, or else the topic.
fn subject(mission: &Mission, event: EventId) -> &str {
    let event = mission.log.events.get(event as usize);
    let names = event.map(|event| mission.elements.names(event.what));
    names
        .and_then(|(node, topic)| node.or(topic))
        .unwrap_or_default()
}

/// The kind of element that an event is about, in the plural.
fn noun(mission: &Mission, event: EventId) -> &'static str {
    let event = mission.log.events.get(event as usize);
    event.map_or("changes", |event| match (event.kind, event.what) {
        (Kind::Rate, _) => "rates",
        (_, Element::Node(_)) => "nodes",
        (Kind::Appeared | Kind::Vanished, Element::Publish(_) | Element::Subscribe(_)) => EDGES,
        _ => "topics",
    })
}

/// Combines some names into one.
fn fold(
    frame: &mut Frame,
    names: &[NamePlace],
    space: Option<usize>,
    view: &View,
    mission: &Mission,
) {
    let event = |(at, name): &NamePlace| frame.caption[*at].events[*name];
    let mut events: Vec<EventId> = names.iter().map(event).collect();
    let (count, noun, at) = (names.len(), noun(mission, events[0]), names[0].0);
    events.sort_unstable();
    let space_name = space.map(|at| &*view.namespaces[at].name);
    let place = space_name.filter(|space| !frame.note.starts_with(space));
    let place = place.map_or_else(String::new, |space| format!(" in {space}"));
    for (at, name) in names.iter().rev() {
        frame.caption[*at].names.remove(*name);
        frame.caption[*at].events.remove(*name);
    }
    let sign = frame.caption[at].sign;
    if noun == EDGES {
        // Their phrases have different words.
        let tail = if sign == '+' { "appear" } else { "end" };
        let phrase = Phrase {
            sign,
            tail: tail.to_owned(),
            ..Phrase::default()
        };
        frame.caption.insert(at, phrase);
    }
    let phrase = &mut frame.caption[at];
    phrase.names.insert(0, format!("{count} {noun}{place}"));
    phrase.events.insert(0, FOLDED);
    frame.caption.retain(|phrase| !phrase.names.is_empty());
    let (mark, sign) = match sign {
        '+' => (Mark::Added, "+"),
        '−' => (Mark::Removed, "−"),
        _ => (Mark::Changed, ""),
    };
    frame.crowds.push(Crowd {
        space,
        mark,
        words: format!("{sign}{count} {noun}"),
        events,
    });
}

impl View {
    /// The looks in window `k` with the colours of crowds on their frames alone.
    pub(crate) fn calm(&self, k: usize) -> SeenWindow {
        let mut seen = self.seen(k);
        if let Some(frame) = self.frames.get(k) {
            for shown in seen.items.iter_mut().chain(&mut seen.arrows) {
                frame.calm(shown);
            }
        }
        seen
    }
}

impl Frame {
    /// Removes the colour from a look whose events are those of a crowd: it is drawn as unchanged, or as
    /// ended; a collapsed namespace keeps its words.
    pub(crate) fn calm(&self, shown: &mut Shown) {
        let in_crowd = |event: &EventId| {
            let mut crowds = self.crowds.iter();
            crowds.any(|crowd| crowd.events.binary_search(event).is_ok())
        };
        if matches!(shown.mark, None | Some(Mark::Away))
            || shown.events.is_empty()
            || !shown.events.iter().all(in_crowd)
        {
            return;
        }
        let is_ghost = shown.is_ghost();
        shown.rates = None;
        shown.mark = is_ghost.then_some(Mark::Gone);
        shown
            .topics
            .retain(|row| is_ghost || row.mark != Some(Mark::Removed));
        for row in &mut shown.topics {
            (row.mark, row.rates) = (None, None);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::view::testing::mission;
    use crate::view::{ViewOptions, view};

    /// The last window of a picture: its headline, its crowds, and the boxes that have a colour.
    fn last(windows: &[&str]) -> (String, Vec<String>, Vec<String>) {
        let options = ViewOptions {
            is_picture: true,
            ..ViewOptions::default()
        };
        let (view, _) = view(&mission(windows), &options);
        let frame = view.frames.last().unwrap();
        let seen = view.calm(view.frames.len() - 1);
        let has_color = |shown: &&Shown| shown.mark.is_some_and(Mark::has_color);
        let coloured = seen.items.iter().filter(has_color);
        let name = |at: Option<usize>| at.map_or("page", |at| &*view.namespaces[at].name);
        let crowd = |crowd: &Crowd| format!("{}: {}", name(crowd.space), crowd.words);
        (
            frame.fitting(|_| true),
            frame.crowds.iter().map(crowd).collect(),
            coloured
                .map(|shown| view.items[shown.id as usize].name.to_string())
                .collect(),
        )
    }

    #[test]
    fn five_changes_have_a_colour_each() {
        let (words, crowds, coloured) = last(&["/a", "/a /r/b /r/c /r/d /r/e /r/f"]);
        assert_eq!(words, "+ b, c, d, e, f start");
        assert_eq!((crowds.len(), coloured.len()), (0, 5));
    }

    #[test]
    fn more_than_five_changes_of_a_namespace_are_one_frame() {
        let (words, crowds, coloured) = last(&["/a /r/x>/t", "/b /r/b /r/c /r/d /r/e /r/f"]);
        assert_eq!(words, "− /a, x stop; + 5 nodes, /b start");
        assert_eq!(crowds, ["/r: +5 nodes"]);
        assert_eq!(coloured, ["/a", "/b", "/r/x"]);
    }

    #[test]
    fn nodes_that_stop_together_are_drawn_without_their_colour() {
        let windows = ["/a /r/b /r/c /r/d /r/e /r/f /r/g", "/a"];
        let (words, crowds, coloured) = last(&windows);
        assert_eq!(words, "− 6 nodes stop");
        assert_eq!(crowds, ["/r: −6 nodes"]);
        assert!(coloured.is_empty(), "{coloured:?}");
        let options = ViewOptions {
            is_picture: true,
            ..ViewOptions::default()
        };
        let (view, _) = view(&mission(&windows), &options);
        let seen = view.calm(1);
        let gone = seen.items.iter().filter(|s| s.mark == Some(Mark::Gone));
        assert_eq!((gone.count(), seen.items.len()), (6, 7));
    }

    #[test]
    fn edges_of_many_nodes_are_one_crowd() {
        let all = ["/b", "/c", "/d", "/e", "/f", "/g"];
        let after: Vec<String> = all.iter().map(|node| format!("{node}</t")).collect();
        let (before, after) = (all.join(" "), after.join(" "));
        let (words, crowds, _) = last(&[&format!("/a>/t {before}"), &format!("/a>/t {after}")]);
        assert_eq!(words, "+ 6 edges appear");
        assert_eq!(crowds, ["page: +6 edges"]);
    }

    #[test]
    fn a_crowd_outside_of_all_namespaces_colours_the_page() {
        let (words, crowds, coloured) = last(&["/a", "/a /b /c /d /e /f /g"]);
        assert_eq!(words, "+ 6 nodes start");
        assert_eq!(crowds, ["page: +6 nodes"]);
        assert!(coloured.is_empty(), "{coloured:?}");
    }
}
