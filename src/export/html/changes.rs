//! The changes that a page lists, read from the event log: per window for the script, and as a table for readers without
//! scripts, for printing, and for links into the mission.

use std::collections::{BTreeMap, BTreeSet};

use serde::Serialize;

use super::{HtmlPage, PageGraph};
use crate::base::time::Stamp;
use crate::base::words::{self, visible};
use crate::draw::paint::xml::Xml;
use crate::draw::picture::change_counts;
use crate::draw::picture::title::SIDES;
use crate::draw::timeline::Timeline;
use crate::graph::Element;
use crate::mission::EventId;
use crate::mission::event_log::{Event, Kind, LogFormat, LogLine, LogRow, interrupted, row_lines};
use crate::view::{Frame, Headline, OngoingEvent};

/// The headlines of a window, the interruptions that begin in it, and the elements that are back in it: its index, the number of
/// headlines, the texts of the three badges, its lines, and the film's headline.
#[derive(Serialize)]
pub(super) struct ChangedWindow(usize, usize, [String; 3], Vec<ChangeLine>, String);

/// A change: its time in seconds, its sign (0 appeared, 1 vanished, 2 changed), its element (-1 for one that is not drawn),
/// its sentence, its index in the log unless it is an interruption, and its time in words.
#[derive(Serialize)]
struct ChangeLine(f64, u8, i64, String, Option<EventId>, String);

/// The most headlines of one window that are listed; the rest is counted.
const MOST_REPORTED: usize = 200;
/// The most rows of the table; the rest is counted.
const MOST_ROWS: usize = 200;
/// The most phrases of a window's headline; the rest is counted.
const MOST_PHRASES: usize = 5;

/// The origin of times in seconds.
#[derive(Clone, Copy)]
pub(super) struct PageClock(pub(super) Stamp);

impl PageClock {
    /// The seconds from the origin to `at`, rounded down to milliseconds, as everywhere.
    pub(super) fn secs(self, at: Stamp) -> f64 {
        at.since(self.0).div_euclid(1_000_000) as f64 / 1e3
    }
}

/// The element that represents each node, topic and edge.
fn places(drawn: &PageGraph<'_>) -> BTreeMap<Element, u32> {
    let mut places = BTreeMap::new();
    let items = drawn.view.items.iter().map(|item| &item.members);
    let arrows = drawn.order.iter().map(|id| &drawn.view.arrows[*id].members);
    for (members, place) in items.chain(arrows).zip(0..) {
        for member in members {
            places.entry(*member).or_insert(place);
        }
    }
    places
}

/// The changes that a page lists.
pub(super) struct PageChanges {
    /// The windows with changes.
    pub(super) windows: Vec<ChangedWindow>,
    /// The element that represents each node, topic and edge.
    pub(super) places: BTreeMap<Element, u32>,
    pub(super) clock: PageClock,
    /// The lifelines of the mission, if there are any.
    pub(super) lives: Option<Timeline>,
}

impl PageChanges {
    pub(super) fn new(page: &HtmlPage<'_>) -> Self {
        let (mission, whole) = (page.sequence.mission, &page.whole);
        let view = whole.view;
        let places = places(whole);
        let clock = PageClock(view.frames.first().map_or(Stamp(0), |f| f.span.start));
        let events = mission.log.events.with_ids();
        let events: Vec<_> = events.filter(|(_, event)| event.is_headline()).collect();
        let rows = events.iter().map(|(id, event)| LogRow::Event(*id, event));
        let rows: Vec<LogRow<'_>> = rows.collect();
        let written = row_lines(mission, &rows, LogFormat::Text);
        let said = events
            .iter()
            .zip(&written)
            .map(|((id, event), line)| (*id, (*event, line)));
        let said: BTreeMap<EventId, (&Event, &LogLine)> = said.collect();
        let place = |what: &Element| places.get(what).map_or(-1, |at| i64::from(*at));
        // Two missions have no common time.
        let secs =
            |frame: &Frame, at| clock.secs(if view.compares { frame.span.start } else { at });
        let back = |frame: &Frame, last: &OngoingEvent| {
            let (end, away) = (last.ended?, last.ended?.since(last.since));
            let (node, topic) = mission.elements.names(last.what);
            let name = visible(node.or(topic).unwrap_or_default());
            let text = format!("{name} is back after {}", words::duration(away));
            let when = words::offset_tenths(mission.offset(end));
            let at = secs(frame, end);
            Some(ChangeLine(
                at,
                2,
                place(&last.what),
                text,
                Some(last.event),
                when,
            ))
        };
        let line = |frame: &Frame, headline: &Headline| {
            let (event, line) = said.get(&headline.event)?;
            let sign = match event.kind {
                Kind::Started | Kind::Appeared => 0,
                Kind::Stopped | Kind::Vanished => 1,
                _ => 2,
            };
            // The list is sorted by the best estimate of each time, so that it has no ranges.
            let when = match line.lead().trim() {
                range if range.contains('–') => {
                    format!("~{}", words::offset_seconds(mission.offset(event.time)))
                }
                exact => exact.to_owned(),
            };
            let (at, place) = (secs(frame, event.time), place(&headline.what));
            let (text, id) = (line.words.clone(), Some(headline.event));
            Some(ChangeLine(at, sign, place, text, id, when))
        };
        let interruptions = |frame: &Frame| {
            let all = mission.log.interruptions.iter();
            let inside = all.filter(|one| frame.span.contains(one.time));
            let line = inside.map(|one| {
                let when = words::offset_tenths(mission.offset(one.time));
                let at = clock.secs(one.time);
                ChangeLine(at, 2, -1, interrupted(one), None, when)
            });
            line.collect::<Vec<_>>()
        };
        let frames = view.frames.iter().enumerate();
        let frames = frames.filter(|(_, frame)| frame.is_changed());
        let windows = frames.map(|(at, frame)| {
            let mut counts = change_counts(&frame.counts).map(|(text, _)| text);
            let returns = frame.ongoing.iter().filter_map(|last| back(frame, last));
            let returns: Vec<ChangeLine> = returns.collect();
            if frame.headlines.is_empty() && !returns.is_empty() {
                counts[2] = format!("{} back", returns.len());
            }
            let headlines = frame.headlines.iter().take(MOST_REPORTED);
            let headlines = headlines.filter_map(|headline| line(frame, headline));
            let lines = interruptions(frame).into_iter().chain(headlines);
            ChangedWindow(
                at,
                frame.counts.total(),
                counts,
                lines.chain(returns).collect(),
                visible(&frame.words(MOST_PHRASES)).into_owned(),
            )
        });
        let windows: Vec<ChangedWindow> = windows.collect();
        // The list has every mark: a part of an event is marked only if the event is listed.
        let listed = windows
            .iter()
            .flat_map(|w| w.3.iter().filter_map(|line| line.4));
        let listed: BTreeSet<EventId> = listed.collect();
        let whole = |id| mission.log.events.get(id).and_then(|event| event.part_of);
        let is_listed = |id: &EventId| view.compares || listed.contains(&whole(*id).unwrap_or(*id));
        let mut lives = page.sequence.unfolded.and_then(|u| u.lives).cloned();
        for row in lives.iter_mut().flat_map(|lives| &mut lives.rows) {
            row.marks.retain(|mark| mark.events.iter().any(is_listed));
        }
        Self {
            windows,
            places,
            clock,
            lives,
        }
    }

    /// A row per change: its time as a link, and its sentence; empty without changes.
    pub(super) fn table(&self, compares: bool) -> String {
        let lines = self.windows.iter();
        let lines = lines.flat_map(|w| w.3.iter().map(|line| (w.0, line)));
        let mut lines: Vec<(usize, &ChangeLine)> = lines.collect();
        // Windows may overlap.
        lines.sort_by(|(_, a), (_, b)| a.0.total_cmp(&b.0).then(a.4.cmp(&b.4)));
        lines.dedup_by(|(_, a), (_, b)| (a.0, a.4) == (b.0, b.4));
        let mut xml = Xml::default();
        if lines.is_empty() {
            return String::new();
        }
        xml.open("details").attribute("open", "");
        xml.leaf(
            "summary",
            ["All changes", "Differences"][usize::from(compares)],
        );
        if lines.len() > MOST_ROWS {
            let text = format!("The first {MOST_ROWS} of {}:", lines.len());
            xml.leaf("p", &text);
        }
        xml.open("table")
            .open("tbody")
            .attribute("id", "allchanges");
        for (window, ChangeLine(at, _, _, text, event, when)) in lines.into_iter().take(MOST_ROWS) {
            let when = if compares { SIDES[window.min(1)] } else { when };
            xml.open("tr");
            if let Some(event) = event {
                xml.attribute("data-entry", event);
            }
            xml.open("th");
            xml.open("a").attribute("href", format_args!("#t={at}"));
            xml.text(when).close().close();
            xml.leaf("td", text).close().raw("\n");
        }
        xml.close().close().close();
        xml.finish()
    }
}
