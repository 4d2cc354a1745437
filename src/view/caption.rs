//! The caption of a window: its headlines in words, the most important first.

use std::collections::BTreeMap;

use super::items::Viewed;
use super::{Headline, ItemKind, Phrase};
use crate::base::name::last_part;
use crate::base::time::{Span, Stamp};
use crate::base::words;
use crate::graph::{Element, Elements, NodeId};
use crate::mission::Mission;
use crate::mission::ledger::{Detail, Entry, EntryId, Kind, Ledger};

/// The largest number of headlines of one kind that are told one by one; more are told together.
const MOST_NAMED: usize = 3;
/// The largest length of a name in characters; longer ones are cut.
const LONGEST_NAME: usize = 48;

/// A writer of captions: it puts headlines into words, with full names, so that equal names in two namespaces are told
/// apart.
pub(crate) struct Speaker<'a> {
    elements: &'a Elements,
    viewed: &'a Viewed,
    ledger: &'a Ledger,
    /// Per headline of a node, the number of topics that came or went with it.
    topics: BTreeMap<EntryId, usize>,
    /// The headlines that last, in the order of their ends.
    lasting: Vec<(Stamp, &'a Entry)>,
}

impl<'a> Speaker<'a> {
    pub(crate) fn new(mission: &'a Mission, viewed: &'a Viewed) -> Self {
        let mut topics = BTreeMap::new();
        for entry in &mission.ledger.entries {
            if let (Some(whole), Element::Topic(_)) = (entry.part_of, entry.what)
                && viewed.sees(entry.what)
                && matches!(entry.kind, Kind::Appeared | Kind::Vanished)
            {
                *topics.entry(whole).or_default() += 1;
            }
        }
        let entries = mission.ledger.entries.iter();
        let lasting = entries.filter(|e| e.is_headline() && viewed.sees(e.what));
        let mut lasting: Vec<(Stamp, &Entry)> =
            lasting.filter_map(|e| Some((e.until?, e))).collect();
        lasting.sort_by_key(|(until, _)| *until);
        Self {
            elements: &mission.elements,
            viewed,
            ledger: &mission.ledger,
            topics,
            lasting,
        }
    }

    /// A phrase for every headline, or for all of a kind where there are more than [`MOST_NAMED`].
    pub(crate) fn caption(&self, headlines: &[Headline]) -> Vec<Phrase> {
        const ORDER: [Kind; 11] = [
            Kind::Started,
            Kind::Stopped,
            Kind::Restarted,
            Kind::HandedOver,
            Kind::Silent,
            Kind::Appeared,
            Kind::Vanished,
            Kind::Lifecycle,
            Kind::Type,
            Kind::Qos,
            Kind::Rate,
        ];
        let mut phrases = Vec::new();
        for kind in ORDER {
            let of_kind = headlines.iter().filter(|h| h.kind == kind);
            let all: Vec<&Headline> = of_kind.collect();
            if all.len() > MOST_NAMED && together(kind).is_some() {
                phrases.push(self.together(kind, &all));
            } else {
                phrases.extend(all.iter().map(|h| self.phrase(h)));
            }
        }
        phrases
    }

    /// A phrase for what is back from a silence or an absence that an earlier window told; it stands for no headline.
    pub(crate) fn back(&self, window: Span) -> Option<Phrase> {
        let from = self.lasting.partition_point(|(at, _)| *at < window.start);
        let to = self.lasting.partition_point(|(at, _)| *at < window.end);
        let ended = self.lasting[from..to.max(from)].iter();
        let back: Vec<&Entry> = ended
            .map(|(_, e)| *e)
            .filter(|e| e.time < window.start)
            .collect();
        let text = match &back[..] {
            [] => return None,
            [one] => {
                let away = words::duration(one.until.unwrap_or(one.time).since(one.time));
                format!("{} is back after {away}", self.name(one.what))
            }
            all => {
                let names: Vec<String> = all.iter().map(|e| self.short(e.what)).collect();
                format!("{} are back", words::some_of(&names, MOST_NAMED))
            }
        };
        Some(Phrase { text, headlines: 0 })
    }

    /// `4 nodes stopped with 5 topics (planner, costmap, …)`.
    fn together(&self, kind: Kind, all: &[&Headline]) -> Phrase {
        let topics: usize = all.iter().filter_map(|h| self.topics.get(&h.entry)).sum();
        let what = together(kind).unwrap_or_default();
        let names: Vec<String> = all
            .iter()
            .map(|h| self.short(h.what))
            .take(MOST_NAMED)
            .collect();
        Phrase {
            text: format!(
                "{} {what}{}{} ({}, …)",
                all.len(),
                self.verb(kind),
                with(topics),
                names.join(", ")
            ),
            headlines: all.len(),
        }
    }

    fn phrase(&self, headline: &Headline) -> Phrase {
        let name = self.name(headline.what);
        let topics = self.topics.get(&headline.entry).copied().unwrap_or(0);
        let text = match headline.kind {
            Kind::Started | Kind::Stopped | Kind::Restarted | Kind::Silent => {
                format!("{name} {}{}", self.verb(headline.kind), with(topics))
            }
            Kind::Appeared | Kind::Vanished => self
                .edge(headline)
                .unwrap_or_else(|| format!("{name} {}", self.verb(headline.kind))),
            Kind::HandedOver | Kind::Rate | Kind::Lifecycle | Kind::Type | Kind::Qos => {
                self.changed(headline, &name)
            }
        };
        Phrase { text, headlines: 1 }
    }

    fn changed(&self, headline: &Headline, name: &str) -> String {
        let entry = self.ledger.entries.get(headline.entry as usize);
        match entry.map(|e| &e.detail) {
            Some(Detail::Rates { from_hz, to_hz }) => {
                format!("{name} {}", words::rate_change(*from_hz, *to_hz))
            }
            Some(Detail::Senders { from, to }) => {
                let (from, to) = (self.people(from), self.people(to));
                let (from, to) = (prefixed(" from ", &from), prefixed(" to ", &to));
                format!("{name} handed over{from}{to}")
            }
            Some(Detail::Values { from, to })
                if headline.kind == Kind::Lifecycle || self.ledger.compares =>
            {
                match &**from {
                    "" => format!("{name} {}", clip(to)),
                    from => format!("{name} {} → {}", clip(from), clip(to)),
                }
            }
            _ if headline.kind == Kind::Type => format!("{name} changed its type"),
            _ if headline.kind == Kind::Qos => format!("{name} changed its quality of service"),
            _ => format!("{name} changed"),
        }
    }

    /// The verb of a kind of headline, which follows the name of the element it is about.
    fn verb(&self, kind: Kind) -> &'static str {
        match kind {
            Kind::Silent => "fell silent",
            Kind::Lifecycle => "changed",
            kind => self.ledger.word(kind),
        }
    }

    /// The phrase for a headline of an edge: `b now subscribes /t`; `None` for one of a node or topic.
    fn edge(&self, headline: &Headline) -> Option<String> {
        let (Some(node), Some(topic)) = self.elements.ends(headline.what) else {
            return None;
        };
        let verb = match headline.what {
            Element::Publish(_) => "publishes",
            _ => "subscribes to",
        };
        let node = self.name(Element::Node(node));
        let topic = self.name(Element::Topic(topic));
        if self.ledger.compares {
            let side = self.verb(headline.kind);
            return Some(format!("{node} {verb} {topic} {side}"));
        }
        let now = match headline.kind {
            Kind::Appeared => "now",
            _ => "no longer",
        };
        Some(format!("{node} {now} {verb} {topic}"))
    }

    /// The full name of a node (as a role) or topic; of an edge, that of its topic.
    fn name(&self, what: Element) -> String {
        clip(self.whole_name(what).unwrap_or_default())
    }

    fn whole_name(&self, what: Element) -> Option<&str> {
        match what {
            Element::Node(id) => self.node_name(id),
            _ => self.elements.names(what).1,
        }
    }

    /// The label of its box; its role if it has no box of its own.
    fn node_name(&self, id: NodeId) -> Option<&str> {
        let item = self.viewed.node.get(id as usize).copied().flatten();
        let item = item.and_then(|at| self.viewed.items.get(at as usize));
        match item.filter(|i| i.kind == ItemKind::Node && !i.is_replica) {
            Some(item) => Some(&item.label),
            None => self.elements.nodes.get(id as usize).map(|n| &*n.role),
        }
    }

    fn short(&self, what: Element) -> String {
        clip(last_part(self.whole_name(what).unwrap_or_default()))
    }

    /// Nodes by name, whether or not they are shown: `/planner`, `/planner and /teleop`, `4 nodes`.
    fn people(&self, nodes: &[NodeId]) -> String {
        let names: Vec<String> = nodes
            .iter()
            .map(|id| self.name(Element::Node(*id)))
            .collect();
        match &names[..] {
            [] => String::new(),
            [one] => one.clone(),
            [one, two] => format!("{one} and {two}"),
            more => format!("{} nodes", more.len()),
        }
    }
}

/// The noun for several headlines of a kind; `None` for kinds of which each is told by its name.
fn together(kind: Kind) -> Option<&'static str> {
    Some(match kind {
        Kind::Started | Kind::Stopped | Kind::Restarted => "nodes ",
        Kind::Silent => "",
        Kind::Appeared | Kind::Vanished => "connections and topics ",
        Kind::Lifecycle => "states ",
        Kind::HandedOver | Kind::Rate | Kind::Type | Kind::Qos => return None,
    })
}

fn with(topics: usize) -> String {
    match topics {
        0 => String::new(),
        n => format!(" with {}", words::count(n, "topic")),
    }
}

fn clip(name: &str) -> String {
    words::shorten(name, LONGEST_NAME).into_owned()
}

fn prefixed(prefix: &str, text: &str) -> String {
    match text {
        "" => String::new(),
        _ => format!("{prefix}{text}"),
    }
}

#[cfg(test)]
mod tests {
    use crate::view::testing::mission;
    use crate::view::{Frame, Mark, ViewOptions, view};

    fn last(windows: &[&str]) -> Frame {
        let (view, _) = view(&mission(windows), &ViewOptions::default());
        view.frames.last().unwrap().clone()
    }

    /// The caption of the last window.
    fn caption(windows: &[&str]) -> String {
        last(windows).words(usize::MAX)
    }

    #[test]
    fn nodes_come_with_their_topics() {
        assert_eq!(
            caption(&["/a", "/a /cam/driver>/cam/image /cam/driver>/cam/info"]),
            "/cam/driver started with 2 topics"
        );
        assert_eq!(caption(&["/a /b>/t", "/a"]), "/b stopped with 1 topic");
    }

    #[test]
    fn topics_rates_and_connections_have_their_own_words() {
        assert_eq!(caption(&["/a", "/a =/s/scan"]), "/s/scan appeared");
        assert_eq!(
            caption(&["=/s/scan@15", "=/s/scan@7.4"]),
            "/s/scan 15 → 7.4 Hz"
        );
        assert_eq!(
            caption(&["/a>/t /b", "/a>/t /b</t"]),
            "/b now subscribes to /t"
        );
        assert_eq!(
            caption(&["/a>/t /b>/t", "/a>/t /b"]),
            "/b no longer publishes /t"
        );
        assert_eq!(caption(&["/a", "/a"]), "");
    }

    #[test]
    fn a_hand_over_is_told_once() {
        let windows = ["/planner>/cmd_vel@2 /teleop", "/planner /teleop>/cmd_vel@2"];
        let (view, _) = view(&mission(&windows), &ViewOptions::default());
        let (frame, seen) = (&view.frames[1], view.seen(1));
        assert_eq!(
            frame.words(usize::MAX),
            "/cmd_vel handed over from /planner to /teleop"
        );
        let topic = seen.items.last().unwrap();
        assert_eq!(
            (topic.mark, frame.counts.handed_over),
            (Some(Mark::HandedOver), 1)
        );
    }

    #[test]
    fn the_words_of_a_caption_stand_for_all_headlines() {
        let name = "x".repeat(10_000);
        let now = format!("/{name} /b /c /d =/e =/h@5 =/i@5 =/j@5 =/k@5 =/l@5");
        let frame = last(&["/m =/h@1 =/i@1 =/j@1 =/k@1 =/l@1", &now]);
        let told: usize = frame.caption.iter().map(|p| p.headlines).sum();
        assert_eq!((told, frame.counts.total()), (11, 11));
        assert_eq!(frame.headlines.len(), 11);
        assert_eq!(
            frame.words(3),
            "4 nodes started (b, c, d, …); /m stopped; /e appeared; and 5 more"
        );
        assert!(frame.words(usize::MAX).len() < 400);
    }
}
