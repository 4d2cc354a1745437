//! Windows with more changes than a reader can follow: those of one kind in one namespace are one coloured frame
//! with their number, and as few words in the headline.

use std::collections::{BTreeMap, BTreeSet};

use super::{Frame, Mark, SeenWindow, Shown, View};
use crate::base::name::lies_in;
use crate::graph::Element;
use crate::mission::Mission;
use crate::mission::event_log::{EventId, Kind};

/// The most things that have a colour, and a word in the headline, each on its own.
const MOST: usize = 5;
/// The event of a phrase that describes several.
const FOLDED: EventId = EventId::MAX;

/// Changes of one kind in one namespace that are one coloured frame.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Crowd {
    /// The namespace with the frame: a place in [`View::namespaces`]; the whole graph if `None`.
    pub space: Option<usize>,
    /// Its colour.
    pub mark: Mark,
    /// The words on the frame: `+4 nodes`.
    pub words: String,
    /// The headlines, sorted: places in the event log.
    pub events: Vec<EventId>,
}

/// Draws crowds as one in every window.
pub(super) fn gather(view: &mut View, mission: &Mission) {
    let mut frames = std::mem::take(&mut view.frames);
    for frame in &mut frames {
        let words = |frame: &Frame| frame.caption.iter().map(|p| p.names.len()).sum::<usize>();
        while words(frame) > MOST {
            let Some((phrase, names, space)) = largest(frame, view, mission) else {
                break;
            };
            fold(frame, (phrase, &names), space, view, mission);
        }
    }
    view.frames = frames;
}

/// The place of the phrase with most names in one namespace, or anywhere, the places of those names, and the innermost
/// namespace around all of them.
fn largest(
    frame: &Frame,
    view: &View,
    mission: &Mission,
) -> Option<(usize, Vec<usize>, Option<usize>)> {
    let mut groups: BTreeMap<(bool, usize, usize), Vec<usize>> = BTreeMap::new();
    for (at, phrase) in frame.caption.iter().enumerate() {
        for (name, event) in phrase.events.iter().enumerate() {
            if *event == FOLDED {
                continue;
            }
            let around = around(view, subject(mission, *event));
            // The whole graph comes after all namespaces.
            let outermost = around.first().copied().unwrap_or(usize::MAX);
            if outermost < usize::MAX {
                groups.entry((true, at, outermost)).or_default().push(name);
            }
            groups
                .entry((false, at, usize::MAX))
                .or_default()
                .push(name);
        }
    }
    groups.retain(|_, names| names.len() > 1);
    let all: usize = frame.caption.iter().map(|p| p.names.len()).sum();
    let best = groups
        .into_iter()
        .max_by_key(|((is_framed, at, space), names)| {
            // What came is still there in the next window; what went is seen in this one only.
            let stays = frame.caption[*at].sign == '+' && all - names.len() < MOST;
            let order = (usize::MAX - at, usize::MAX - space);
            (*is_framed, stays, names.len(), order)
        });
    let ((_, at, _), names) = best?;
    let events = &frame.caption[at].events;
    let spaces = names
        .iter()
        .map(|name| around(view, subject(mission, events[*name])));
    let common = spaces.reduce(|a, b| {
        let same = a.into_iter().zip(b).take_while(|(a, b)| a == b);
        same.map(|(a, _)| a).collect()
    });
    Some((at, names, common.and_then(|all| all.last().copied())))
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

/// Makes some names of a phrase one.
fn fold(
    frame: &mut Frame,
    (at, names): (usize, &[usize]),
    space: Option<usize>,
    view: &View,
    mission: &Mission,
) {
    let phrase = &mut frame.caption[at];
    let first = mission.log.events.get(phrase.events[names[0]] as usize);
    let noun = first.map_or("changes", |event| match (event.kind, event.what) {
        (Kind::Rate, _) => "rates",
        (_, Element::Node(_)) => "nodes",
        _ => "topics",
    });
    let mut events: Vec<EventId> = names.iter().map(|name| phrase.events[*name]).collect();
    let space_name = space.map(|at| &*view.namespaces[at].name);
    let place = space_name.filter(|space| !frame.note.starts_with(space));
    let place = place.map_or_else(String::new, |space| format!(" in {space}"));
    let count = names.len();
    for name in names.iter().rev() {
        phrase.names.remove(*name);
        phrase.events.remove(*name);
    }
    phrase.names.insert(0, format!("{count} {noun}{place}"));
    phrase.events.insert(0, FOLDED);
    events.sort_unstable();
    let (mark, sign) = match phrase.sign {
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
    /// The looks in window `k` with the colours of crowds on their frames alone: their members are drawn as if nothing
    /// happened, and those that are gone are not drawn, unless a line to them changed itself.
    pub(crate) fn calm(&self, k: usize) -> SeenWindow {
        let seen = self.seen(k);
        let Some(frame) = self.frames.get(k).filter(|frame| !frame.crowds.is_empty()) else {
            return seen;
        };
        let ends = |shown: &Shown| {
            let arrow = self.arrows.get(shown.id as usize);
            arrow.into_iter().flat_map(|arrow| [arrow.from, arrow.to])
        };
        let is_changed = |shown: &&Shown| !shown.events.is_empty() && !frame.is_crowd(shown);
        let reported: BTreeSet<u32> = seen
            .arrows
            .iter()
            .filter(is_changed)
            .flat_map(ends)
            .collect();
        let stays = |shown: &Shown| reported.contains(&shown.id).then(|| shown.clone());
        let items = seen.items.iter();
        let items: Vec<Shown> = items
            .filter_map(|shown| frame.calmed(shown).or_else(|| stays(shown)))
            .collect();
        let is_there = |at: u32| items.binary_search_by_key(&at, |shown| shown.id).is_ok();
        let arrows = seen.arrows.iter().filter(|shown| ends(shown).all(is_there));
        SeenWindow {
            arrows: arrows.filter_map(|shown| frame.calmed(shown)).collect(),
            items,
        }
    }
}

impl Frame {
    /// Whether all events of something are those of a crowd.
    fn is_crowd(&self, shown: &Shown) -> bool {
        let in_crowd = |event: &EventId| {
            let mut crowds = self.crowds.iter();
            crowds.any(|crowd| crowd.events.binary_search(event).is_ok())
        };
        !shown.events.is_empty() && shown.events.iter().all(in_crowd)
    }

    /// A look without its colour, if its events are those of a crowd; `None` for something gone.
    pub(crate) fn calmed(&self, shown: &Shown) -> Option<Shown> {
        let is_crowd = self.is_crowd(shown);
        let mut shown = shown.clone();
        if !is_crowd {
            return Some(shown);
        }
        match shown.mark {
            Some(Mark::Removed) => return None,
            Some(Mark::Away) | None => return Some(shown),
            Some(_) => {}
        }
        (shown.mark, shown.rates, shown.inside) = (None, None, None);
        shown.topics.retain(|row| row.mark != Some(Mark::Removed));
        for row in &mut shown.topics {
            (row.mark, row.rates) = (None, None);
        }
        Some(shown)
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
        let coloured = seen.items.iter().filter(|shown| shown.mark.is_some());
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
    fn a_crowd_outside_of_all_namespaces_colours_the_page() {
        let (words, crowds, coloured) = last(&["/a", "/a /b /c /d /e /f /g"]);
        assert_eq!(words, "+ 6 nodes start");
        assert_eq!(crowds, ["page: +6 nodes"]);
        assert!(coloured.is_empty(), "{coloured:?}");
    }
}
