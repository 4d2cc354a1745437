//! The words of a window: its events as phrases for the headline, and the line below it.

use std::cmp::Reverse;
use std::collections::{BTreeMap, BTreeSet};
use std::mem::discriminant;

use super::items::Viewed;
use super::state::LivingItems;
use super::{Frame, Headline, ItemKind, OngoingEvent, Phrase};
use crate::base::name::{ShortNames, is_quiet};
use crate::base::rhythm::OVERLAP_NS;
use crate::base::time::{SECOND, Stamp};
use crate::base::words;
use crate::graph::{Element, Elements, NodeId, TopicId, Wiring};
use crate::mission::Mission;
use crate::mission::event_log::{Detail, Event, EventId, EventLog, Kind, Parts, interrupted};
use crate::mission::rates::Rates;

/// The largest length of a name in characters; longer ones would fill a headline alone.
const LONGEST_NAME: usize = 48;
/// The most names in the line below the headline, which also has a place and a time.
const MOST_NAMED: usize = 3;

/// The words after what left in an earlier window.
pub(super) const STILL_AWAY: &str = "still away";

/// The kinds of events that the log combines if several happen at once.
const CROWDED: [Kind; 4] = [Kind::Appeared, Kind::Vanished, Kind::Silent, Kind::Rate];

/// A writer of headlines, window by window.
pub(crate) struct CaptionWriter<'a> {
    elements: &'a Elements,
    viewed: &'a Viewed<'a>,
    log: &'a EventLog,
    /// The parts of each event of the log.
    parts: Parts,
    start: Stamp,
    /// Whether there is only one window.
    is_still: bool,
    /// The last event of the windows so far.
    last: Option<Stamp>,
    wiring: Wiring,
    /// The short names of the picture's nodes and topics.
    names: [ShortNames<'a>; 2],
    /// The beginnings of times in which two nodes send a topic, with its id and their roles.
    shared: Vec<(Stamp, TopicId, [&'a str; 2])>,
}

/// The first moment at which two nodes send a topic that do not from the beginning, for long enough to be no hand-over: one of which the
/// log has a hand-over, since then one node at a time is meant to send it. Others, such as markers, have several senders as a matter of course.
fn shared<'a>(mission: &'a Mission, viewed: &Viewed<'_>) -> Vec<(Stamp, TopicId, [&'a str; 2])> {
    let rates = Rates::new(mission);
    let begun = mission.span.start.plus(OVERLAP_NS);
    let mut all = Vec::new();
    let events = mission.log.events.iter();
    let handed = events.filter(|event| event.kind == Kind::HandedOver);
    let handed: BTreeSet<Element> = handed.map(|event| event.what).collect();
    for what in handed.into_iter().filter(|what| viewed.sees(*what)) {
        let (_, Some(id)) = mission.elements.ends(what) else {
            continue;
        };
        for pair in rates.holders(id).windows(2) {
            let times = pair[0].times.iter();
            let times = times.flat_map(|a| pair[1].times.iter().map(move |b| (a, b)));
            let mut both = times.filter(|(a, b)| a.shared(**b) > OVERLAP_NS);
            let since = both.next().map(|(a, b)| a.start.max(b.start));
            let since = since.filter(|since| *since > begun);
            all.extend(since.map(|since| (since, id, [pair[0].role, pair[1].role])));
        }
    }
    all
}

/// The events of a window, in the order of their phrases, each with the values that are equal within one
/// phrase.
type Groups = BTreeMap<(u8, [String; 2]), Phrase>;

impl<'a> CaptionWriter<'a> {
    pub(crate) fn new(mission: &'a Mission, viewed: &'a Viewed<'a>) -> Self {
        let elements = &mission.elements;
        let mut nodes = elements.nodes.ids().map(Element::Node);
        let mut topics = elements.topics.ids().map(Element::Topic);
        let names = |all: &mut dyn Iterator<Item = Element>| {
            let seen = all.filter(|what| viewed.sees(*what));
            seen.map(|what| full_name(elements, viewed, what)).collect()
        };
        Self {
            elements,
            viewed,
            log: &mission.log,
            parts: mission.log.all_parts(),
            start: mission.span.start,
            is_still: mission.windows.len() == 1,
            last: None,
            wiring: elements.wiring(|_, _| true),
            names: [names(&mut nodes), names(&mut topics)],
            shared: shared(mission, viewed),
        }
    }

    /// Puts the events of a window into words; `after` is what lives at its end.
    pub(crate) fn write(&mut self, frame: &mut Frame, after: &LivingItems) {
        let mut groups = Groups::new();
        for headline in &frame.headlines {
            self.phrase(headline).add(&mut groups, headline.event);
            // Equal simultaneous events of other elements are parts of it.
            for id in self.parts.get(&headline.event).into_iter().flatten() {
                if let Some(part) = self.event(*id)
                    && CROWDED.contains(&part.kind)
                    && part.kind == headline.kind
                    && discriminant(&part.what) == discriminant(&headline.what)
                    && self.viewed.sees(part.what)
                {
                    let other = Headline {
                        event: *id,
                        what: part.what,
                        leaves: false,
                        ..*headline
                    };
                    self.phrase(&other).add(&mut groups, headline.event);
                }
            }
        }
        for ongoing in &frame.ongoing {
            self.ongoing(ongoing).add(&mut groups, ongoing.event);
        }
        let (log, span) = (self.log, frame.span);
        let during = log.interruptions.iter();
        let during = during.filter(|one| span.contains(one.time));
        let during = during.map(|one| Phrase {
            sign: ' ',
            names: vec![interrupted(one)],
            events: vec![Vec::new()],
            ..Phrase::default()
        });
        frame.caption = during.chain(groups.into_values().map(plural)).collect();
        frame.note = self.note(frame, after);
    }

    fn event(&self, id: EventId) -> Option<&'a Event> {
        self.log.events.get(id)
    }

    /// The line below the headline: `4:26 · arm_controller gets no detections`; in a window in which nothing
    /// changes `no change since 3:20`.
    fn note(&mut self, frame: &Frame, after: &LivingItems) -> String {
        if self.log.compares {
            let none = frame.caption.is_empty().then_some("no difference");
            return none.unwrap_or_default().to_owned();
        }
        let begun = frame.headlines.iter().map(|h| h.time);
        let times = begun.chain(frame.ongoing.iter().filter_map(|l| l.ended));
        let span = times.fold(None, |span: Option<(Stamp, Stamp)>, at| {
            Some(span.map_or((at, at), |(a, b)| (a.min(at), b.max(at))))
        });
        if frame.caption.is_empty() {
            return match self.last {
                Some(last) => format!("no change since {}", self.moment(last)),
                None if self.is_still => match frame.span.nanos() {
                    0 => "no change".to_owned(),
                    nanos => format!("no change in {}", words::duration(nanos)),
                },
                None => "no change yet".to_owned(),
            };
        }
        let mut parts = Vec::new();
        if let Some((first, last)) = span {
            self.last = Some(last);
            let (first, last) = (self.moment(first), self.moment(last));
            parts.push(if first == last {
                first
            } else {
                format!("{first} – {last}")
            });
        } else if let [one] = &frame.ongoing[..] {
            parts.push(format!("since {}", self.moment(one.since)));
        }
        let leaves = frame.headlines.iter().filter(|h| h.leaves);
        let away = frame.ongoing.iter().filter(|l| l.ended.is_none());
        let mut whats = leaves.map(|h| h.what).chain(away.map(|l| l.what));
        parts.extend(whats.find_map(|what| self.missed(what, after)));
        let mut shared = self.shared.iter();
        let shared = shared.find(|(since, ..)| frame.span.contains(*since));
        parts.extend(shared.map(|(_, topic, roles)| {
            let [a, b] = roles.map(|role| self.names[0].of(role));
            let topic = self.name(Element::Topic(*topic));
            format!("{a} and {b} both send {topic}")
        }));
        parts.retain(|part| !part.is_empty());
        parts.join(" · ")
    }

    fn moment(&self, at: Stamp) -> String {
        let seconds = at.since(self.start).div_euclid(SECOND);
        words::moment(seconds.saturating_mul(SECOND))
    }

    /// The living subscribers without messages while a node is away: `a, b get no detections`; `None` if none is known.
    fn missed(&self, what: Element, after: &LivingItems) -> Option<String> {
        let Element::Node(node) = what else {
            return None;
        };
        let (topic, nodes) = self.audience(node)?;
        let nodes = nodes.iter().map(|id| Element::Node(*id));
        let seen = nodes.filter(|node| self.viewed.sees(*node) && after.has(*node));
        let names: Vec<String> = seen.map(|node| self.name(node)).collect();
        let gets = match names.len() {
            0 => return None,
            1 => "gets",
            _ => "get",
        };
        let topic = self.name(Element::Topic(topic));
        let names = words::some_of(&names, MOST_NAMED);
        Some(format!("{names} {gets} no {topic}"))
    }

    /// Of the topics that only a node (or other runs of it) publishes, the one with most subscribers, and these subscribers:
    /// they lack messages while the node is away.
    fn audience(&self, node: NodeId) -> Option<(TopicId, &[NodeId])> {
        let role = |id: NodeId| self.elements.nodes.get(id).map(|n| &n.role);
        let own = self.wiring.published.get(node)?.iter().filter(|topic| {
            let mut publishers = self.wiring.publishers[**topic].iter();
            !is_quiet(self.elements.topics[**topic].name.as_str())
                && publishers.all(|other| role(*other) == role(node))
        });
        let missed = own.map(|topic| (*topic, &self.wiring.subscribers[*topic][..]));
        let missed = missed.filter(|(_, nodes)| !nodes.is_empty());
        missed.max_by_key(|(topic, nodes)| (nodes.len(), Reverse(*topic)))
    }

    /// An event of an earlier window in this one.
    fn ongoing(&self, ongoing: &OngoingEvent) -> Said {
        let name = self.name(ongoing.what);
        match ongoing.ended {
            None => Said::new(12, ' ', name, STILL_AWAY),
            Some(end) => {
                let away = words::duration(end.since(ongoing.since));
                Said::new(6, ' ', name, &format!("back after {away}"))
            }
        }
    }

    /// The words for a headline. Ends come before beginnings.
    fn phrase(&self, headline: &Headline) -> Said {
        let name = self.name(headline.what);
        let event = self.event(headline.event);
        if self.log.compares {
            return self.compared(headline);
        }
        if headline.leaves {
            return Said::new(1, '−', name, "goes away");
        }
        match headline.kind {
            Kind::Stopped => Said::new(0, '−', name, "stops"),
            Kind::Vanished | Kind::Appeared => self.edge(headline),
            Kind::Silent => Said::new(3, ' ', name, "falls silent"),
            Kind::Started => Said::new(4, '+', name, "starts"),
            Kind::Restarted => {
                let away = event.and_then(Event::lasted).map(words::duration);
                let tail = away.map_or("restarts".to_owned(), |away| {
                    format!("restarts after {away}")
                });
                Said::new(7, ' ', name, &tail)
            }
            Kind::Starved => Said::new(9, ' ', name, "starves a subscriber"),
            Kind::Duplicate => Said::new(9, ' ', name, "is used by two nodes"),
            Kind::Lost => Said::new(12, ' ', name, "lost messages in the recorder"),
            Kind::HandedOver | Kind::Lifecycle | Kind::Type | Kind::Qos | Kind::Rate => {
                self.changed(headline)
            }
        }
    }

    fn changed(&self, headline: &Headline) -> Said {
        let name = self.name(headline.what);
        match self.event(headline.event).map(|e| &e.detail) {
            Some(Detail::Rates { from_hz, to_hz }) => {
                let change = words::rates(&[*from_hz, *to_hz]);
                Said::new(11, ' ', format!("{name} {change}"), "")
            }
            Some(Detail::Senders { from, to }) if !from.is_empty() && !to.is_empty() => {
                let verb = if to.len() == 1 { "takes" } else { "take" };
                let tail = format!("from {}", self.people(from));
                Said {
                    lead: format!("{} {verb} over", self.people(to)),
                    ..Said::new(8, ' ', name, &tail)
                }
            }
            Some(Detail::Senders { .. }) => Said::new(8, ' ', name, "handed over"),
            Some(Detail::Values { from, to }) if headline.kind == Kind::Lifecycle => {
                let change = format!("{} → {}", clip(from), clip(to));
                Said::new(9, ' ', name, change.trim_start())
            }
            _ if headline.kind == Kind::Qos => {
                Said::new(10, ' ', name, "with another quality of service")
            }
            _ => Said::new(10, ' ', name, "with another type"),
        }
    }

    /// A topic that begins or ends, or a connection of a node that stays.
    fn edge(&self, headline: &Headline) -> Said {
        let (rank, sign, verb, not) = match headline.kind {
            Kind::Appeared => (5, '+', "appears", ""),
            _ => (2, '−', "ends", "no longer "),
        };
        let name = self.name(headline.what);
        match self.subject_of_edge(headline.what, not) {
            None => Said::new(rank, sign, name, verb),
            Some(lead) => Said {
                lead,
                ..Said::new(rank, sign, name, "")
            },
        }
    }

    /// The words before the topic of an edge: `controller no longer subscribes to`; `None` for a node or topic.
    fn subject_of_edge(&self, what: Element, not: &str) -> Option<String> {
        let verb = match what {
            Element::Publish(_) => "publishes",
            Element::Subscribe(_) => "subscribes to",
            Element::Node(_) | Element::Topic(_) => return None,
        };
        let node = self.elements.ends(what).0?;
        Some(format!("{} {not}{verb}", self.name(Element::Node(node))))
    }

    /// A difference between two missions.
    fn compared(&self, headline: &Headline) -> Said {
        let name = self.name(headline.what);
        let (rank, sign) = match headline.kind {
            Kind::Stopped | Kind::Vanished => (0, '−'),
            Kind::Started | Kind::Appeared => (1, '+'),
            Kind::Rate | Kind::HandedOver => return self.changed(headline),
            _ => {
                let event = self.event(headline.event);
                let Some(Detail::Values { from, to }) = event.map(|e| &e.detail) else {
                    return self.changed(headline);
                };
                let change = format!("{name} {} → {}", clip(from), clip(to));
                return Said::new(9, ' ', change.replace("  ", " "), "");
            }
        };
        Said {
            lead: self.subject_of_edge(headline.what, "").unwrap_or_default(),
            ..Said::new(rank, sign, name, self.log.word(headline.kind))
        }
    }

    /// The name of a node (as a role) or topic in the fewest parts that identify it in the picture; of an edge, that of its
    /// topic.
    fn name(&self, what: Element) -> String {
        let names = &self.names[usize::from(!matches!(what, Element::Node(_)))];
        clip(names.of(full_name(self.elements, self.viewed, what)))
    }

    fn people(&self, nodes: &[NodeId]) -> String {
        let names = nodes.iter();
        let names: Vec<String> = names.map(|id| self.name(Element::Node(*id))).collect();
        words::some_of(&names, 2)
    }
}

/// One event in words, with its rank among the phrases of a window.
struct Said {
    rank: u8,
    sign: char,
    lead: String,
    name: String,
    tail: String,
}

impl Said {
    fn new(rank: u8, sign: char, name: String, tail: &str) -> Self {
        Self {
            rank,
            sign,
            lead: String::new(),
            name,
            tail: tail.to_owned(),
        }
    }

    /// Adds it to an equal phrase.
    fn add(self, groups: &mut Groups, event: EventId) {
        let key = (self.rank, [self.lead.clone(), self.tail.clone()]);
        let all = groups.entry(key).or_insert(Phrase {
            sign: self.sign,
            lead: self.lead,
            tail: self.tail,
            ..Phrase::default()
        });
        if let Some(at) = all.names.iter().position(|other| *other == self.name) {
            all.events[at].push(event);
        } else {
            all.names.push(self.name);
            all.events.push(vec![event]);
        }
    }
}

/// A phrase with its verb in the number of its names.
fn plural(phrase: Phrase) -> Phrase {
    const VERBS: [(&str, &str); 7] = [
        ("goes away", "go away"),
        ("stops", "stop"),
        ("falls silent", "fall silent"),
        ("starts", "start"),
        ("appears", "appear"),
        ("ends", "end"),
        ("restarts", "restart"),
    ];
    let verb = VERBS.iter().find(|(one, _)| phrase.tail.starts_with(one));
    let many = verb.filter(|_| phrase.names.len() > 1 && phrase.lead.is_empty());
    let tail = many.map(|(one, many)| phrase.tail.replacen(one, many, 1));
    Phrase {
        tail: tail.unwrap_or(phrase.tail),
        ..phrase
    }
}

fn clip(name: &str) -> String {
    words::shorten(name, LONGEST_NAME).into_owned()
}

/// The name of a node as its box has it, or its role if it has no box of its own; that of a topic, or of an edge's.
fn full_name<'a>(elements: &'a Elements, viewed: &'a Viewed<'a>, what: Element) -> &'a str {
    let Element::Node(id) = what else {
        return without_transport(elements.names(what).1.unwrap_or_default());
    };
    let item = viewed.item_of(what).and_then(|at| viewed.items.get(at));
    match item.filter(|i| i.kind == ItemKind::Node && !i.is_replica) {
        Some(item) => &item.label,
        None => elements.nodes.get(id).map_or("", |node| &*node.role),
    }
}

/// The name of an image topic without its transport.
fn without_transport(name: &str) -> &str {
    const TRANSPORTS: [&str; 3] = ["/compressed", "/compressedDepth", "/theora"];
    let cut = TRANSPORTS.iter().find_map(|end| name.strip_suffix(end));
    cut.filter(|rest| !rest.is_empty()).unwrap_or(name)
}

#[cfg(test)]
mod tests {
    use crate::view::testing::mission;
    use crate::view::{Frame, Mark, ViewOptions, joined, view};

    fn last(windows: &[&str]) -> Frame {
        let (view, _) = view(&mission(windows), &ViewOptions::default());
        view.frames.last().unwrap().clone()
    }

    /// The caption of the last window.
    fn caption(windows: &[&str]) -> String {
        last(windows).words(usize::MAX)
    }

    #[test]
    fn names_have_the_fewest_parts_that_identify_them() {
        let frame = last(&["/a", "/a /cam/driver>/cam/image /cam/driver>/cam/info"]);
        assert_eq!(frame.words(usize::MAX), "+ driver starts");
        assert_eq!(frame.note, "0:10");
        assert_eq!(
            caption(&["/a /arm/driver", "/a /cam/driver"]),
            "− arm/driver stops; + cam/driver starts"
        );
        assert_eq!(
            caption(&["/a /b>/t", "/a /c /d"]),
            "− b stops; + c, d start"
        );
    }

    #[test]
    fn topics_rates_and_connections_have_their_own_wording() {
        assert_eq!(caption(&["/a", "/a =/s/scan"]), "+ scan appears");
        assert_eq!(
            caption(&["=/s/scan@15", "=/s/scan@7.4"]),
            "scan 15 → 7.4 Hz"
        );
        assert_eq!(caption(&["/a>/t /b", "/a>/t /b</t"]), "+ b subscribes to t");
        assert_eq!(
            caption(&["/a>/t /a>/u /b>/t /b>/u", "/a>/t /a>/u /b"]),
            "− b no longer publishes t, u"
        );
        assert_eq!(caption(&["/a", "/a"]), "");
        assert_eq!(last(&["/a", "/a"]).note, "no change yet");
    }

    #[test]
    fn a_hand_over_is_reported_once() {
        let windows = ["/planner>/cmd_vel@2 /teleop", "/planner /teleop>/cmd_vel@2"];
        let (view, _) = view(&mission(&windows), &ViewOptions::default());
        let (frame, seen) = (&view.frames[1], view.seen(1));
        assert_eq!(
            frame.words(usize::MAX),
            "teleop takes over cmd_vel from planner"
        );
        let topic = seen.items.last().unwrap();
        assert_eq!(
            (topic.mark, frame.counts.handed_over),
            (Some(Mark::HandedOver), 1)
        );
    }

    #[test]
    fn names_are_shortened_until_the_headline_fits() {
        let name = "x".repeat(10_000);
        let now = format!("/{name} /b /c /d =/e =/h@4 =/i@5 =/j@7 =/k@9 =/l@12");
        let frame = last(&["/m =/h@1 =/i@1 =/j@1 =/k@1 =/l@1", &now]);
        let named: usize = frame.caption.iter().map(|p| p.names.len()).sum();
        assert_eq!((named, frame.counts.total()), (11, 11));
        assert_eq!(frame.headlines.len(), 11);
        assert_eq!(
            frame.words(3),
            "− m stops; + b, c, d, +1 start; + e appears; +5"
        );
        assert!(joined(&frame.fitting(|_| true)).contains("k 1 → 9 Hz"));
        let fitting = |most| joined(&frame.fitting(|words| joined(words).chars().count() < most));
        let short = fitting(40);
        assert_eq!(short, "− m stops; + b, c, d, +1 start; +6");
        assert_eq!(fitting(0), "− m stops; +10");
    }
}
