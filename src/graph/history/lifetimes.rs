//! The lifetimes of nodes from those of their edges, of edges within those of their nodes, of topics from
//! both. For example, `/nav` logs from 3 s to 90 s and sends `/plan` at 1 Hz until 90 s of 300 s: `/nav` exists until 90 s,
//! `/nav` publishes `/plan` for as long, and `/plan` exists as long as one of its ends does.

use std::collections::{BTreeMap, BTreeSet};
use std::rc::Rc;

use crate::base::ids::Few;
use crate::base::rhythm::{
    ADVERTISED_NS, BREAK, BREAK_NS, DISCOVERY_NS, FEWEST, FOUND_NS, GONE_NS, REGISTRATION_NS,
    SHUTDOWN_NS, UNUSUAL,
};
use crate::base::time::{Span, Stamp};
use crate::evidence::inference::ElementKey;
use crate::evidence::observation::Name;
use crate::evidence::{Confidence, Evidence};
use crate::graph::history::restarts::{Restart, Restarts};
use crate::graph::history::{Bound, Stretch, hide, strays};

/// The signs and lifetimes of every element.
///
/// Boxed, since the tree reserves much unused memory.
pub(crate) type LivenessOf = BTreeMap<ElementKey, Box<Liveness>>;

/// The elements that exist as long as others, each with its other.
pub(crate) type Likes = Vec<(ElementKey, ElementKey)>;

/// No edge has a smaller key: nodes and topics come before.
const FIRST_EDGE: ElementKey = ElementKey::Publish(Name(0), Name(0));

/// Computes all lifetimes; `mission` contains the first and last moments.
pub(crate) fn compute_lifetimes(
    liveness_of: &mut LivenessOf,
    likes: &[(ElementKey, ElementKey)],
    restarts: &Restarts,
    mission: (Stamp, Stamp),
) {
    let mut closed: BTreeMap<Name, Option<Stamp>> = BTreeMap::new();
    // An edge that exists as long as its node is evidence for its topic, but not for the node.
    let of_nodes = likes
        .iter()
        .filter(|(_, other)| matches!(other, ElementKey::Node(_)));
    let followers: BTreeSet<ElementKey> = of_nodes.map(|(what, _)| *what).collect();
    let mut edges = liveness_of.split_off(&FIRST_EDGE);
    // A recorder subscribes to topics because they exist, so its subscriptions do not show how long they do.
    let nodes = liveness_of
        .iter()
        .filter_map(|(what, liveness)| match what {
            ElementKey::Node(node) if liveness.evidence.has("recorder") => Some(*node),
            _ => None,
        });
    let recorders: BTreeSet<Name> = nodes.collect();
    let is_recorded = |what: &ElementKey| matches!(what, ElementKey::Subscribe(_, node) if recorders.contains(node));
    for (what, liveness) in &edges {
        let [Some(node), Some(topic)] = what.ends() else {
            continue;
        };
        let last = closed.entry(node).or_insert(Some(Stamp::MIN));
        *last = last.and_then(|last| liveness.closed(last));
        let learner = liveness_of.entry(ElementKey::Node(node)).or_default();
        if followers.contains(what)
            && liveness.signs.is_empty()
            && liveness.confidence > Confidence::Stated
        {
            learner.evidence = learner.evidence.and(liveness.evidence);
        } else {
            learner.learn(liveness);
        }
        let known = liveness_of.entry(ElementKey::Topic(topic)).or_default();
        known.know(liveness, is_recorded(what));
    }
    // A node ended if its last connection was closed and it has no later sign.
    for (node, end) in closed {
        let end = end.filter(|end| *end > Stamp::MIN);
        if let (Some(end), Some(liveness)) = (end, liveness_of.get_mut(&ElementKey::Node(node)))
            && liveness.signs.iter().all(|sign| *sign <= end)
        {
            liveness.ends.push(end);
        }
    }
    for (what, liveness) in liveness_of.iter_mut() {
        if let ElementKey::Node(node) = what {
            liveness.live(mission, true);
            for restart in restarts.of(*node) {
                liveness.restart(restart);
            }
        }
    }
    let mut of_topics: Few<Name, Vec<Lifetime>> = Few::default();
    let mut of_recorders: Few<Name, Vec<Lifetime>> = Few::default();
    let mut recorded: Vec<ElementKey> = Vec::new();
    for (what, liveness) in &mut edges {
        let [Some(node), Some(topic)] = what.ends() else {
            continue;
        };
        let around = liveness_of.get(&ElementKey::Node(node));
        liveness.live_within(&around.map(|t| Rc::clone(&t.lives)).unwrap_or_default());
        if is_recorded(what) {
            add_lives(of_recorders.grown(topic), &liveness.lives);
            recorded.push(*what);
        } else {
            add_lives(of_topics.grown(topic), &liveness.lives);
        }
    }
    liveness_of.append(&mut edges);
    live_like(liveness_of, likes, false, |what, lives| {
        if let [_, Some(topic)] = what.ends() {
            add_lives(of_topics.grown(topic), lives);
        }
    });
    for (what, liveness) in liveness_of.iter_mut() {
        if let ElementKey::Topic(topic) = what {
            let edges = std::mem::take(of_topics.grown(*topic));
            liveness.live(mission, false);
            liveness.live_with(edges);
            if liveness.lives.is_empty() {
                liveness.live_with(std::mem::take(of_recorders.grown(*topic)));
            }
        }
    }
    for what in recorded {
        let [_, Some(topic)] = what.ends() else {
            continue;
        };
        let around = liveness_of.get(&ElementKey::Topic(topic));
        let around = around.map(|t| Rc::clone(&t.lives)).unwrap_or_default();
        if let Some(liveness) = liveness_of.get_mut(&what) {
            liveness.stay_within(&around);
        }
    }
    live_like(liveness_of, likes, true, |_, _| {});
}

/// Adds the lifetimes of an edge to those of its topic's edges, very many of which may be equal.
fn add_lives(all: &mut Vec<Lifetime>, lives: &[Lifetime]) {
    for life in lives {
        if all.last() != Some(life) {
            all.push(*life);
        }
    }
}

/// Gives elements the lifetimes of others, either topics or not; those with signs of their own, the beginnings.
fn live_like(
    liveness_of: &mut LivenessOf,
    likes: &[(ElementKey, ElementKey)],
    topics: bool,
    mut given: impl FnMut(ElementKey, &[Lifetime]),
) {
    for (what, other) in likes {
        if matches!(other, ElementKey::Topic(_)) == topics
            && let Some(lives) = liveness_of.get(other).map(|t| Rc::clone(&t.lives))
            && let Some(liveness) = liveness_of.get_mut(what)
        {
            if liveness.signs.is_empty() {
                liveness.lives = lives;
            } else if !liveness.begin_with(&lives) {
                continue;
            }
            given(*what, &liveness.lives);
        }
    }
}

// One lifetime of an element: when it begins and ends by the evidence for both.

/// A period of existence, both ends included; it never ends before it begins.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(crate) struct Lifetime {
    pub(crate) from: Stamp,
    pub(crate) to: Stamp,
    /// The first sign of it.
    pub(crate) sign: Stamp,
    pub(crate) began: Option<Bound>,
    pub(crate) ended: Option<Bound>,
}

impl Lifetime {
    /// A lifetime of the whole mission.
    pub(crate) fn whole(mission: (Stamp, Stamp)) -> Self {
        Self {
            from: mission.0,
            to: mission.1,
            sign: mission.0,
            began: None,
            ended: None,
        }
    }

    /// Sets the beginning, which is not after the end.
    fn begin_at(&mut self, from: Stamp, began: Option<Bound>) {
        (self.from, self.began) = (from.min(self.to), began);
    }

    /// Sets the end, which is not before the beginning.
    fn end_at(&mut self, to: Stamp, ended: Option<Bound>) {
        (self.to, self.ended) = (to.max(self.from), ended);
    }

    /// One of a single sign, which began after `gone`.
    fn at(sign: Stamp, gone: Stamp) -> Self {
        Self {
            from: sign,
            to: sign,
            sign,
            began: Some(Bound::new(sign, gone, sign)),
            ended: None,
        }
    }

    /// The part of it inside another one; `None` if they do not overlap.
    fn within(&self, other: &Self) -> Option<Self> {
        let later = if other.from > self.from { other } else { self };
        let sooner = if other.to < self.to { other } else { self };
        (later.from <= sooner.to).then_some(Self {
            from: later.from,
            to: sooner.to,
            sign: self.sign.max(later.from),
            began: later.began,
            ended: sooner.ended,
        })
    }

    /// Ends the lifetime because of evidence.
    fn close(&mut self, end: Stamp) {
        let (last, end) = (self.to, end.max(self.to));
        let ended = Bound::new(end, last, end);
        self.end_at(end, Some(ended));
    }

    /// Sets the beginning of a first lifetime: with a rhythm it began shortly before its first sign, and in any case after
    /// its last known absence.
    /// `recording` is the start of its own recording, one of several; without evidence it began before.
    fn begin(&mut self, mission: Stamp, recording: Stamp, period: Option<i64>, is_proved: bool) {
        let late = period.unwrap_or(0);
        if !is_proved || self.from.since(recording) <= FOUND_NS.saturating_add(late) {
            self.begin_at(mission, None);
        } else if let Some(began) = &mut self.began {
            let sooner = DISCOVERY_NS.saturating_add(late);
            let possible = period.map_or(mission, |_| self.from.plus(-sooner));
            began.earliest = began.earliest.max(possible);
        }
    }

    /// Sets the beginning of an edge's first lifetime inside its node's; `absent` is the first moment at
    /// which it may exist, if known. A first message that is not due earlier (`is_due`) is not a beginning.
    fn begin_within(&mut self, around: &Self, absent: Option<Stamp>, stated: bool, is_due: bool) {
        let registered = around.from.plus(REGISTRATION_NS);
        match absent {
            Some(absent) => {
                if stated {
                    self.from = absent.max(registered).min(self.from);
                }
                if let Some(began) = &mut self.began {
                    began.earliest = absent;
                }
            }
            None if stated || is_due || self.from.since(around.sign) <= ADVERTISED_NS => {
                self.begin_at(around.from, around.began);
            }
            None => {
                if let Some(began) = &mut self.began {
                    began.earliest = around.from;
                }
            }
        }
    }
}

/// Lifetimes between ends, from sorted signs and sorted ends; an end at the time of a sign comes after it.
/// The true end lies between the evidence and the sign before, the true beginning between the sign and the
/// end before.
fn lives(signs: &[Stamp], ends: &[Stamp]) -> Vec<Lifetime> {
    let mut lives: Vec<Lifetime> = Vec::new();
    let mut ends = ends.iter().copied().peekable();
    let (mut open, mut gone) = (false, Stamp::MIN);
    for sign in signs {
        while let Some(end) = ends.next_if(|end| end < sign) {
            if let Some(life) = lives.last_mut().filter(|_| open) {
                life.close(end);
            }
            (open, gone) = (false, end);
        }
        match lives.last_mut() {
            Some(life) if open => life.end_at(*sign, None),
            _ => lives.push(Lifetime::at(*sign, gone)),
        }
        open = true;
    }
    if let (Some(life), Some(end)) = (lives.last_mut(), ends.next()) {
        life.close(end);
    }
    lives.shrink_to_fit();
    lives
}

// The signs of one element, and the lifetimes that follow from them: from the first sign to the last, extended by latched
// messages, ended by evidence of an end.

/// The extent of a lifetime.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) enum Extent {
    /// From its first sign to its last.
    Signs,
    /// The whole mission, unless there are signs: a header or a file declares it.
    Whole,
    /// The whole mission, regardless of signs.
    Always,
}

/// The rhythm of an element's messages in the last stretch.
#[derive(Clone, Copy)]
pub(crate) struct Pulse {
    first: Stamp,
    /// The time of the last message.
    pub(crate) last: Stamp,
    /// The time between two messages, in nanoseconds.
    period: i64,
    /// The longest pause between two stretches, in nanoseconds; 0 for none.
    pause: i64,
    is_even: bool,
    /// The end of its recording: another one may go on without it.
    until: Stamp,
}

impl Pulse {
    /// The rhythm of a sender, if it has one. Its pauses are neither restarts nor the recorder's, nor before it.
    pub(crate) fn of(
        stretches: &[Stretch],
        restarts: &[Restart],
        recorder: &[Span],
        until: Stamp,
    ) -> Option<Self> {
        let last = stretches.last()?;
        let steady = stretches.get(strays(stretches)..).unwrap_or_default();
        let pauses = steady.windows(2).map(|p| (p[0].last, p[1].first));
        let pauses = pauses.filter(|(from, to)| {
            let mut away = restarts.iter().map(|r| *from <= r.birth && r.death <= *to);
            !away.any(|is_away| is_away) && !hide(recorder, (*from, Some(*to)))
        });
        let pauses = pauses.map(|(from, to)| to.since(from));
        (last.count >= FEWEST).then(|| Self {
            first: stretches[0].first,
            last: last.last,
            period: last.period,
            pause: pauses.max().unwrap_or(0),
            is_even: last.is_even,
            until,
        })
    }

    /// Whether the silence at the end is too long for the rhythm.
    pub(crate) fn broke_off(&self, end: Stamp) -> bool {
        self.silence(self.last, end) > self.patience()
    }

    /// The silence after a last sign, in nanoseconds, as far as it was recorded.
    fn silence(&self, sign: Stamp, end: Stamp) -> i64 {
        end.min(self.until).since(sign)
    }

    /// The longest insignificant silence, in nanoseconds.
    fn patience(&self) -> i64 {
        let times = if self.is_even { BREAK } else { BREAK * UNUSUAL };
        let silence = self.period.saturating_mul(times);
        silence
            .max(self.pause.saturating_mul(UNUSUAL))
            .max(BREAK_NS)
    }
}

/// The known signs and lifetimes of one element.
pub(crate) struct Liveness {
    pub(crate) evidence: Evidence,
    /// The strongest confidence of evidence for it.
    pub(crate) confidence: Confidence,
    /// Signs that bound lifetimes: sorted later.
    pub(crate) signs: Vec<Stamp>,
    /// Signs that bound nothing: for a topic, those of its edges, which have their own lifetimes.
    pub(crate) seen: Vec<Stamp>,
    /// The signs that state a fact that may have been true before.
    pub(crate) stated: Vec<Stamp>,
    /// The signs among these that appear as soon as the fact is true: statistics of a connection.
    pub(crate) counted: Vec<Stamp>,
    /// Evidence of an end.
    pub(crate) ends: Vec<Stamp>,
    /// The times at which something that shows it began, such as a rhythm.
    pub(crate) begins: Vec<Stamp>,
    /// The times among these at which a recorder found its topics, or it declared its parameters: as it began.
    pub(crate) found: Vec<Stamp>,
    /// The last sign of its own: a message that it sent, or a statement about itself.
    pub(crate) last_sign: Option<Stamp>,
    /// Its messages; boxed, since very many elements may be known without any.
    messages: Option<Box<Messages>>,
    /// Whether there is more evidence than latched messages.
    pub(crate) speaks: bool,
    /// Whether there is more evidence than single moments.
    pub(crate) lasts: bool,
    /// Whether it exists to the end, regardless of its signs.
    pub(crate) unending: bool,
    /// Whether it exists for the whole mission.
    pub(crate) extent: Extent,
    /// Shared by all edges of a node that exist as long as it does.
    pub(crate) lives: Rc<Vec<Lifetime>>,
}

/// The messages of an element.
#[derive(Default)]
pub(crate) struct Messages {
    /// Their rhythms.
    pub(crate) pulses: Vec<Pulse>,
    /// The first and the last moment of their recordings; `None` for the whole mission.
    pub(crate) recording: Option<(Stamp, Stamp)>,
    /// The time until which the first message is due if they are sent from the start of the recording.
    pub(crate) due: Option<Stamp>,
    /// The number of their senders, and of those that are latched.
    pub(crate) senders: (u32, u32),
}

impl Default for Liveness {
    fn default() -> Self {
        Self {
            evidence: Evidence::NONE,
            confidence: Confidence::Declared,
            signs: Vec::new(),
            seen: Vec::new(),
            stated: Vec::new(),
            counted: Vec::new(),
            ends: Vec::new(),
            begins: Vec::new(),
            found: Vec::new(),
            last_sign: None,
            messages: None,
            speaks: false,
            lasts: false,
            unending: false,
            extent: Extent::Signs,
            lives: Rc::default(),
        }
    }
}

impl Messages {
    /// Extends the time of the recordings by that of another one.
    pub(crate) fn reach(&mut self, recording: Option<(Stamp, Stamp)>) {
        if let Some((from, to)) = recording {
            let all = self.recording.get_or_insert((from, to));
            *all = (all.0.min(from), all.1.max(to));
        }
    }
}

impl Liveness {
    /// Its messages, to add to them.
    pub(crate) fn messages(&mut self) -> &mut Messages {
        self.messages.get_or_insert_default()
    }

    fn pulses(&self) -> &[Pulse] {
        self.messages.as_ref().map_or(&[], |m| &m.pulses)
    }

    /// The number of senders whose messages show it, and the number of those that are latched.
    fn senders(&self) -> (u32, u32) {
        self.messages.as_ref().map_or((0, 0), |m| m.senders)
    }

    /// Whether there are messages whose senders show it.
    pub(crate) fn has_senders(&self) -> bool {
        self.senders().0 > 0
    }

    /// Adds signs, sorted, of a fact that may have begun before; of those with no end between them only the outer two
    /// are kept.
    pub(crate) fn sign_all(&mut self, signs: &[Stamp], ends: &[Stamp]) {
        let before = self.signs.len();
        self.bound_all(signs, ends);
        self.stated.extend(&self.signs[before..]);
    }

    /// Adds signs, sorted, that are beginnings; of those with no end between them only the outer two are kept.
    pub(crate) fn bound_all(&mut self, signs: &[Stamp], ends: &[Stamp]) {
        let before = |time: &Stamp| ends.partition_point(|end| end < time);
        for run in signs.chunk_by(|a, b| before(a) == before(b)) {
            self.signs.extend(run.first());
            self.signs.extend(run.last());
        }
        self.ends.extend(ends);
    }

    /// Adds the evidence for another element that also supports this one: an edge supports its node and its
    /// topic.
    pub(crate) fn learn(&mut self, other: &Self) {
        self.evidence = self.evidence.and(other.evidence);
        self.confidence = self.confidence.min(other.confidence);
        self.signs.extend(&other.signs);
        self.begins.extend(&other.begins);
        self.found.extend(&other.found);
        self.last_sign = self.last_sign.max(other.last_sign);
        if let Some(others) = &other.messages {
            let own = self.messages();
            own.pulses.extend(&others.pulses);
            own.reach(others.recording);
            own.senders.0 += others.senders.0;
            own.senders.1 += others.senders.1;
        }
        self.speaks |= other.speaks;
        self.lasts |= other.lasts;
        self.extent = self.extent.max(other.extent.min(Extent::Whole));
    }

    /// Computes the lifetimes from the signs alone. A lifetime without a known end continues: missing
    /// evidence is not absence. For the same reason a node without evidence of its beginning exists from the
    /// start; a topic with an uneven rhythm does not end.
    pub(crate) fn live(&mut self, mission: (Stamp, Stamp), is_node: bool) {
        self.signs.sort_unstable();
        self.ends.sort_unstable();
        self.ends.dedup();
        if self.is_whole() {
            self.lives = vec![Lifetime::whole(mission)].into();
            return;
        }
        let mut lives = lives(&self.signs, &self.ends);
        let recording = self.messages.as_ref().and_then(|m| m.recording);
        let (start, recorded) = recording.unwrap_or(mission);
        let end = self.end(recorded.min(mission.1), is_node);
        if let Some(life) = lives.last_mut().filter(|life| life.ended.is_none()) {
            let ended = end.filter(|end| end.time >= life.from);
            life.end_at(ended.map_or(mission.1, |end| end.time), ended);
        }
        if let Some(life) = lives.first_mut() {
            let pulses = self.pulses().iter();
            let rhythm = pulses.filter(|p| p.first.since(life.from) <= DISCOVERY_NS);
            let is_close = |found: &Stamp| found.since(life.from).abs() <= DISCOVERY_NS;
            let is_found = self.found.iter().any(is_close);
            let period = rhythm.map(|p| p.period).chain(is_found.then_some(0)).min();
            let is_absent = |began: Bound| began.earliest > Stamp::MIN;
            let is_near = |begin: &Stamp| begin.since(life.sign).abs() <= ADVERTISED_NS;
            let is_proved = !is_node
                || !self.lasts
                || life.began.is_some_and(is_absent)
                || self.begins.iter().any(is_near);
            life.begin(mission.0, start.max(mission.0), period, is_proved);
        }
        // The user's files may state times outside of the mission.
        let whole = Lifetime::whole(mission);
        let inside = lives.iter().filter_map(|life| life.within(&whole));
        self.lives = Rc::new(inside.collect());
    }

    /// Sets the possible times of a restart: the node still existed for a period after its last message, and again
    /// before its first.
    pub(crate) fn restart(&mut self, restart: &Restart) {
        let period = self.pulses().iter().map(|p| p.period).min().unwrap_or(0);
        for life in Rc::make_mut(&mut self.lives) {
            if let Some(ended) = life.ended.as_mut().filter(|e| e.time == restart.death) {
                let latest = restart.death.plus(period.max(SHUTDOWN_NS));
                ended.latest = if restart.is_proved {
                    latest.min(restart.birth)
                } else {
                    restart.birth
                };
                // The time of the restart is that of the start.
                if !restart.is_timed() {
                    ended.earliest = restart.death;
                }
            }
            if let Some(began) = life.began.as_mut().filter(|b| b.time == restart.birth) {
                let earliest = restart.birth.plus(-DISCOVERY_NS - period);
                began.earliest = if restart.is_proved {
                    earliest.max(restart.death)
                } else {
                    restart.death
                };
            }
        }
    }

    /// Adds the evidence for an edge to its topic, which exists as long as the edge unless that `follows` it. The senders
    /// are counted on the topic itself.
    pub(crate) fn know(&mut self, edge: &Self, follows: bool) {
        self.evidence = self.evidence.and(edge.evidence);
        self.confidence = self.confidence.min(edge.confidence);
        if edge.is_whole() && !follows {
            self.extent = self.extent.max(Extent::Whole);
        }
        self.seen.extend(edge.signs.iter().chain(&edge.seen));
    }

    /// Joins the lifetimes of a topic with those of its edges, which may overlap.
    pub(crate) fn live_with(&mut self, edges: Vec<Lifetime>) {
        let mut all = std::mem::take(Rc::make_mut(&mut self.lives));
        let joined = Rc::make_mut(&mut self.lives);
        all.extend(edges);
        all.sort_by_key(|life| (life.from, life.to));
        for life in all {
            match joined.last_mut() {
                Some(last) if life.from <= last.to.plus(1) => {
                    if life.to > last.to {
                        last.end_at(life.to, life.ended);
                    } else if life.to == last.to && life.ended.is_none() {
                        last.ended = None;
                    }
                }
                _ => joined.push(life),
            }
        }
    }

    /// The time at which a rhythm stopped for good, if one did; for an element known only at single moments,
    /// the last moment.
    fn end(&self, mission: Stamp, is_node: bool) -> Option<Bound> {
        if !self.lasts && !self.unending {
            let last = self.signs.last();
            return last.map(|last| Bound::new(*last, *last, mission));
        }
        let last_sign = self.last_sign.filter(|_| !self.unending)?;
        let broken = self.pulses().iter().filter(|p| {
            // A rhythm that ended long before the last sign does not explain the silence after it.
            let silence = p.silence(last_sign, mission);
            let ends = last_sign.since(p.last) <= p.patience() && silence > p.patience();
            ends && (is_node || p.is_even)
        });
        let is_long = |p: &Pulse| p.silence(last_sign, mission) > GONE_NS;
        let is_sure = !is_node || broken.clone().any(is_long) || broken.clone().count() > 1;
        let fastest = broken.min_by_key(|p| p.period).filter(|_| is_sure)?;
        Some(Bound::new(
            last_sign,
            fastest.last.min(last_sign),
            last_sign.plus(fastest.period.max(SHUTDOWN_NS)).min(mission),
        ))
    }

    /// Computes the lifetimes of an edge inside those of its node: a node that has advertised or subscribed
    /// to a topic does so until it ends, unless the contrary is known. A stated fact was true before the
    /// statement, unless its absence is known; a first message, in contrast, is a beginning.
    pub(crate) fn live_within(&mut self, node: &Rc<Vec<Lifetime>>) {
        self.signs.sort_unstable();
        self.ends.sort_unstable();
        self.ends.dedup();
        self.stated.sort_unstable();
        if self.is_whole() {
            self.lives = Rc::clone(node);
            return;
        }
        let mut own = Vec::new();
        for around in node.iter() {
            let from = self.signs.partition_point(|s| *s < around.from);
            let to = self.signs.partition_point(|s| *s <= around.to);
            let mut inside = lives(&self.signs[from..to], &self.ends);
            if let Some(first) = inside.first_mut() {
                let next = self.ends.partition_point(|end| *end < first.from);
                let absent = next.checked_sub(1).map(|at| self.ends[at].plus(1));
                let absent = absent.filter(|at| *at > around.from);
                let stated = self.stated.binary_search(&first.from).is_ok();
                let dated = absent.is_some() && self.counted.contains(&first.from);
                let due = self.messages.as_ref().and_then(|m| m.due);
                let is_due = around.began.is_none() && due.is_some_and(|due| first.from <= due);
                first.begin_within(around, absent, stated && !dated, is_due);
            }
            if let Some(last) = inside.last_mut().filter(|l| l.ended.is_none()) {
                let end = self.end(around.to, false).filter(|_| !self.lasts);
                let to = end.map_or(around.to, |end| end.time.max(last.to));
                last.end_at(to, end.or(around.ended));
            }
            if own.is_empty() {
                own = inside;
            } else {
                own.extend(inside);
            }
        }
        self.lives = Rc::new(own);
    }

    /// Limits its lifetimes to those of an element without which it does not exist.
    pub(crate) fn stay_within(&mut self, others: &[Lifetime]) {
        let own = self.lives.iter();
        let inside = own.flat_map(|life| others.iter().filter_map(|other| life.within(other)));
        self.lives = Rc::new(inside.collect());
    }

    /// Dates its beginnings back to those of an element without which it does not exist, unless it is known to be absent
    /// between them: messages may come later. Returns whether there is one.
    pub(crate) fn begin_with(&mut self, others: &[Lifetime]) -> bool {
        let mut is_earlier = false;
        let mut until = Stamp::MIN;
        for life in Rc::make_mut(&mut self.lives) {
            let around = |o: &&Lifetime| o.from < life.from && life.from <= o.to;
            let is_absent = |from: Stamp| {
                let mut ends = self.ends.iter();
                ends.any(|end| from <= *end && *end < life.from)
            };
            let other = others.iter().find(around).filter(|o| until < o.from);
            if let Some(other) = other.filter(|other| !is_absent(other.from)) {
                life.begin_at(other.from, other.began);
                is_earlier = true;
            }
            until = life.to;
        }
        is_earlier
    }

    /// The end of the last of several edges: this one, and others that ended at `last`; `None` if nothing
    /// shows that it ended.
    pub(crate) fn closed(&self, last: Stamp) -> Option<Stamp> {
        if self.signs.is_empty() {
            return (!self.is_whole()).then_some(last);
        }
        let end = self.ends.iter().max()?;
        let open = self.signs.iter().any(|sign| sign > end);
        (!open).then_some(last.max(*end))
    }

    /// Whether it is shown by messages that are all latched.
    pub(crate) fn is_latched(&self) -> bool {
        self.has_senders() && self.senders().0 == self.senders().1
    }

    /// Whether it is known from a header or a file only.
    pub(crate) fn is_declared(&self) -> bool {
        self.signs.is_empty() && self.is_whole() && self.confidence == Confidence::Declared
    }

    /// Whether it exists for the whole mission.
    fn is_whole(&self) -> bool {
        match self.extent {
            Extent::Signs => false,
            Extent::Whole => self.signs.is_empty(),
            Extent::Always => true,
        }
    }

    /// The first and last sign.
    pub(crate) fn bounds(&self) -> (Option<Stamp>, Option<Stamp>) {
        let all = || self.signs.iter().chain(&self.seen).copied();
        (all().min(), all().max())
    }
}

#[cfg(test)]
mod tests {
    mod lifetime {
        use super::super::*;

        fn stretches(signs: &[i64], ends: &[i64]) -> Vec<(i64, i64)> {
            let stamps = |list: &[i64]| list.iter().map(|t| Stamp(*t)).collect::<Vec<_>>();
            let lives = lives(&stamps(signs), &stamps(ends));
            lives.iter().map(|l| (l.from.0, l.to.0)).collect()
        }

        #[test]
        fn a_beginning_is_not_before_the_last_known_absence() {
            let stamp = |seconds: i64| Stamp(seconds * 1_000_000_000);
            let earliest = |ends: &[Stamp], period| {
                let mut life = lives(&[stamp(30)], ends)[0];
                life.begin(stamp(0), stamp(0), period, true);
                life.began.unwrap().earliest
            };
            assert_eq!(earliest(&[stamp(4), stamp(20)], None), stamp(20));
            assert_eq!(earliest(&[stamp(29)], Some(5_000_000_000)), stamp(29));
            assert_eq!(earliest(&[], None), stamp(0));
        }

        #[test]
        fn a_lifetime_spans_its_signs() {
            assert_eq!(stretches(&[1, 5, 9], &[]), [(1, 9)]);
            assert_eq!(stretches(&[], &[4]), []);
        }

        #[test]
        fn an_end_closes_a_lifetime_and_the_next_sign_begins_another() {
            assert_eq!(stretches(&[1, 5, 9, 10], &[6]), [(1, 6), (9, 10)]);
            assert_eq!(stretches(&[1, 5], &[0, 7, 8]), [(1, 7)]);
            assert_eq!(stretches(&[1, 5], &[5]), [(1, 5)]);
        }
    }

    mod liveness {
        use super::super::*;

        #[test]
        fn statistics_date_a_subscription_before_the_list_without_it() {
            let stamp = |seconds: i64| Stamp(seconds * 1_000_000_000);
            let began = |counted: Vec<Stamp>| {
                let mut edge = Liveness {
                    lasts: true,
                    ..Liveness::default()
                };
                // A list without it at 10 s, statistics at 30 s, a list with it at 60 s.
                edge.sign_all(&[stamp(30), stamp(60)], &[stamp(10)]);
                edge.counted = counted;
                edge.live_within(&vec![Lifetime::whole((stamp(0), stamp(90)))].into());
                edge.lives[0].from
            };
            assert_eq!(began(Vec::new()), stamp(10).plus(1));
            assert_eq!(began(vec![stamp(30)]), stamp(30));
        }
    }
}
