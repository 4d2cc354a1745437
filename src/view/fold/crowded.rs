//! Windows with more changes than a reader can follow: changes of one kind in one namespace become one
//! coloured frame with their number, and a short phrase in the headline.
//!
//! Six nodes of `/nav` start in one window: a green frame around `/nav` says `+6 nodes`, and so does the headline.

use std::cmp::Reverse;
use std::collections::BTreeMap;

use crate::base::name::lies_in;
use crate::base::words;
use crate::graph::Element;
use crate::mission::Mission;
use crate::mission::event_log::{Event, EventId, Kind};
use crate::view::{Frame, Mark, Phrase, SeenWindow, Shown, View};

/// The most changes that have their own colour and their own words in the headline: with more
/// of them, colours no longer say where to look, and the headline would only count the rest as `+3`.
const MOST: usize = 5;
/// The words for the numbers of a crowd, in this order.
const NOUNS: [&str; 4] = ["node", "topic", "edge", "rate"];
const EDGE: usize = 2;

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
pub(crate) fn gather(view: &mut View, mission: &Mission) {
    let mut frames = std::mem::take(&mut view.frames);
    for frame in &mut frames {
        let mut changes = changes(frame, view, mission);
        while changes.len() > MOST
            && let Some(group) = largest(&changes)
        {
            join(&mut changes, &group);
        }
        if changes.iter().any(Change::is_crowd) {
            tell(frame, &changes, view);
        }
    }
    view.frames = frames;
}

/// A name in the headline, or several that are combined.
#[derive(Clone, Default)]
struct Change {
    /// The index of its phrase, and the words of this phrase around it.
    at: usize,
    phrase: Phrase,
    name: String,
    /// The number of names for each of [`NOUNS`].
    counts: [usize; 4],
    events: Vec<EventId>,
    /// The namespaces with a frame around it, the outermost first.
    around: Vec<usize>,
}

impl Change {
    fn size(&self) -> usize {
        self.counts.iter().sum()
    }

    fn is_crowd(&self) -> bool {
        self.size() > 1
    }

    /// Its kind: edges that appear or end have different words, and are of one kind.
    fn kind(&self) -> (Option<char>, usize) {
        if self.counts[EDGE] == self.size() {
            (Some(self.phrase.sign), 0)
        } else {
            (None, self.at)
        }
    }

    /// `+4 nodes, 1 edge`
    fn words(&self) -> String {
        let counts = self.counts.iter().zip(NOUNS).filter(|(n, _)| **n > 0);
        let words: Vec<String> = counts.map(|(n, noun)| words::count(*n, noun)).collect();
        words.join(", ")
    }
}

/// Every name in the headline of a window.
fn changes(frame: &Frame, view: &View, mission: &Mission) -> Vec<Change> {
    let phrases = frame.caption.iter().enumerate();
    let named = phrases.flat_map(|(at, phrase)| {
        let names = phrase.names.iter().zip(&phrase.events);
        names.map(move |(name, events)| (at, phrase, name, events))
    });
    let change = |(at, phrase, name, events): (usize, &Phrase, &String, &Vec<EventId>)| {
        let event = mission.log.events.get(*events.first()?)?;
        let mut counts = [0; 4];
        counts[noun(event)] = 1;
        let (node, topic) = mission.elements.names(event.what);
        let subject = node.or(topic).unwrap_or_default();
        let spaces = view.namespaces.iter().enumerate();
        let around = spaces.filter(|(_, space)| lies_in(subject, &space.name));
        Some(Change {
            at,
            phrase: Phrase {
                names: Vec::new(),
                events: Vec::new(),
                ..phrase.clone()
            },
            name: name.clone(),
            counts,
            events: events.clone(),
            around: around.map(|(at, _)| at).collect(),
        })
    };
    named.filter_map(change).collect()
}

/// The kind of element that an event is about: an index into [`NOUNS`].
fn noun(event: &Event) -> usize {
    match (event.kind, event.what) {
        (Kind::Rate, _) => 3,
        (_, Element::Node(_)) => 0,
        (Kind::Appeared | Kind::Vanished, Element::Publish(_) | Element::Subscribe(_)) => EDGE,
        _ => 1,
    }
}

/// The largest group of changes of one kind in one namespace; if there is none, of one kind anywhere, then of one noun,
/// or else with one sign.
fn largest(changes: &[Change]) -> Option<Vec<usize>> {
    let mut groups: BTreeMap<_, Vec<usize>> = BTreeMap::new();
    for (at, change) in changes.iter().enumerate() {
        let (kind, sign) = (Some(change.kind()), change.phrase.sign);
        let outermost = change.around.first().copied();
        let framed = outermost.map(|space| (3, sign, kind, space));
        let noun = change.counts.iter().position(|n| *n == change.size());
        let alike = noun.map(|noun| (1, sign, None, noun));
        // The whole graph comes after all namespaces.
        let anywhere = [(2, sign, kind, usize::MAX), (0, sign, None, usize::MAX)];
        for key in framed.into_iter().chain(alike).chain(anywhere) {
            groups.entry(key).or_default().push(at);
        }
    }
    groups.retain(|_, group| group.len() > 1);
    let best = groups
        .into_iter()
        .max_by_key(|((level, sign, _, space), group)| {
            // New elements are still visible in the next window; elements that ended are visible in this one only.
            let stays = *sign == '+' && changes.len() - group.len() < MOST;
            let is_other = *level == 0 && *sign == ' ';
            let order = (Reverse(changes[group[0]].at), Reverse(*space));
            (*level, !is_other, stays, group.len(), order)
        });
    best.map(|(_, group)| group)
}

/// Combines some changes into one, at the place of the first.
fn join(changes: &mut Vec<Change>, group: &[usize]) {
    let mut all = changes[group[0]].clone();
    for other in group[1..].iter().map(|at| &changes[*at]) {
        all.events.extend(&other.events);
        for (sum, n) in all.counts.iter_mut().zip(other.counts) {
            *sum += n;
        }
        let same = all.around.iter().zip(&other.around);
        let same = same.take_while(|(a, b)| a == b).count();
        all.around.truncate(same);
        if other.phrase != all.phrase {
            // Their phrases have different words.
            all.phrase.lead.clear();
            let tail = match all.phrase.sign {
                '+' => "appear",
                '−' => "end",
                _ => "change",
            };
            tail.clone_into(&mut all.phrase.tail);
        }
    }
    all.events.sort_unstable();
    all.events.dedup();
    for at in group.iter().rev() {
        changes.remove(*at);
    }
    changes.insert(group[0], all);
    changes.sort_by_key(|change| (change.at, !change.is_crowd()));
}

/// Writes the headline again, and adds the frames of crowds.
fn tell(frame: &mut Frame, changes: &[Change], view: &View) {
    frame.caption.clear();
    for change in changes {
        let mut name = change.name.clone();
        if change.is_crowd() {
            let (space, sign) = (change.around.last().copied(), change.phrase.sign);
            let place = space.map(|at| &*view.namespaces[at].name);
            let place = place.filter(|space| !frame.note.starts_with(space));
            let place = place.map_or_else(String::new, |space| format!(" in {space}"));
            name = change.words() + &place;
            let (mark, sign) = match sign {
                '+' => (Mark::Added, "+"),
                '−' => (Mark::Removed, "−"),
                _ => (Mark::Changed, ""),
            };
            frame.crowds.push(Crowd {
                space,
                mark,
                words: format!("{sign}{}", change.words()),
                events: change.events.clone(),
            });
        }
        let is_other = |last: &Phrase| {
            let [last, new] = [last, &change.phrase].map(|p| (p.sign, &p.lead, &p.tail));
            last != new
        };
        if frame.caption.last().is_none_or(is_other) {
            frame.caption.push(change.phrase.clone());
        }
        if let Some(phrase) = frame.caption.last_mut() {
            phrase.names.push(name);
            phrase.events.push(change.events.clone());
        }
    }
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
    /// Whether an event is a reason for a mark: elements begin and end only by events about this.
    fn gives(&self, event: EventId, mark: Option<Mark>) -> bool {
        use Kind::{Appeared, Restarted, Started, Stopped, Vanished};
        let headline = self.headlines.iter().find(|h| h.event == event);
        let of_life = [Appeared, Restarted, Started, Stopped, Vanished];
        !matches!(mark, Some(Mark::Added | Mark::Removed))
            || headline.is_none_or(|h| of_life.contains(&h.kind))
    }

    /// Removes the events of a crowd from a look with others, and the colour from one without: it is drawn as
    /// unchanged, or as ended; a collapsed namespace keeps its words.
    pub(crate) fn calm(&self, shown: &mut Shown) {
        let in_crowd = |event: &EventId| {
            let mut crowds = self.crowds.iter();
            crowds.any(|crowd| crowd.events.binary_search(event).is_ok())
        };
        if matches!(shown.mark, None | Some(Mark::Away)) || shown.events.is_empty() {
            return;
        }
        let others = shown
            .events
            .iter()
            .copied()
            .filter(|event| !in_crowd(event));
        let others: Vec<EventId> = others.collect();
        if others.iter().any(|event| self.gives(*event, shown.mark)) {
            shown.events = others;
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
    use crate::view::{Headline, ViewOptions, view};

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
                .map(|shown| view.items[shown.item()].name.to_string())
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
    fn more_than_five_kinds_of_changes_are_at_most_five_frames_and_colours() {
        let before = "/a /b /c>/p /c>/q@5 /d>/r@5 /e";
        let after = "/a /f /c /e</q /c>/q@50 /d>/r@1 /g =/new";
        let (words, crowds, _) = last(&[before, after]);
        let want =
            "− /b stops; − /c no longer publishes /p; + 2 nodes, 1 topic, 1 edge appear; 2 rates";
        assert_eq!(words, want);
        assert_eq!(crowds, ["page: +2 nodes, 1 topic, 1 edge", "page: 2 rates"]);
    }

    #[test]
    fn a_collapsed_namespace_has_the_colour_of_changes_that_are_in_no_crowd() {
        let options = ViewOptions {
            is_picture: true,
            collapse: vec!["/n".into()],
            ..ViewOptions::default()
        };
        let before = "/n/a>/n/t@5 /n/k";
        let after = "/n/a>/n/t@50 /b /c /d /e /n/f";
        let (view, _) = view(&mission(&[before, after]), &options);
        let seen = view.calm(1);
        let of = |name: &str| {
            let item = seen
                .items
                .iter()
                .find(|s| &*view.items[s.item()].name == name);
            item.map(|shown| (shown.mark, shown.events.len()))
        };
        assert_eq!(view.frames[1].crowds.len(), 1);
        assert_eq!(of("/n"), Some((Some(Mark::Inside), 2)));
        assert_eq!(of("/b").map(|(mark, _)| mark), Some(None));
    }

    #[test]
    fn what_ends_in_a_crowd_is_grey_even_if_its_rate_changed_too() {
        let headline = |(event, kind)| Headline {
            event,
            kind,
            ..Headline::started()
        };
        let crowd = Crowd {
            space: None,
            mark: Mark::Removed,
            words: String::new(),
            events: vec![EventId(0)],
        };
        let calm = |second: Kind| {
            let frame = Frame {
                headlines: [(EventId(0), Kind::Stopped), (EventId(1), second)]
                    .map(headline)
                    .to_vec(),
                crowds: vec![crowd.clone()],
                ..Frame::default()
            };
            let mut shown = Shown {
                mark: Some(Mark::Removed),
                events: vec![EventId(0), EventId(1)],
                ..Shown::default()
            };
            frame.calm(&mut shown);
            shown.mark
        };
        assert_eq!(calm(Kind::Rate), Some(Mark::Gone));
        assert_eq!(calm(Kind::Vanished), Some(Mark::Removed));
    }

    #[test]
    fn a_crowd_outside_of_all_namespaces_colours_the_page() {
        let (words, crowds, coloured) = last(&["/a", "/a /b /c /d /e /f /g"]);
        assert_eq!(words, "+ 6 nodes start");
        assert_eq!(crowds, ["page: +6 nodes"]);
        assert!(coloured.is_empty(), "{coloured:?}");
    }
}
