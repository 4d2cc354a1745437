//! One row per bag of a folder: format, span, topics, nodes, edges by confidence, evidence.

use serde::Serialize;

use super::{Info, NodeInfo, TopicInfo, info};
use crate::bag::Report;
use crate::base::columns::{Cell, Column, WHOLE, hang, table};
use crate::base::name::{is_player, is_recorder};
use crate::base::table::{Batch, ColumnKind, ColumnOf, TableCell, columns};
use crate::base::time::Stamp;
use crate::base::words::{self, visible};
use crate::evidence::Evidence;
use crate::mission::Mission;

/// A bag in a survey.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct SurveyRow {
    /// The path relative to the folder surveyed.
    pub path: String,
    /// Its size in bytes; `None` if unknown.
    pub file_bytes: Option<u64>,
    /// Whether nothing was lost; an empty bag may be intact.
    pub is_complete: bool,
    /// The reason why there is no summary, which is then empty.
    pub error: Option<String>,
    /// The summary of the bag.
    pub info: Option<Info>,
}

impl SurveyRow {
    /// The row of what was read.
    pub(crate) fn of(path: String, mission: &Mission) -> Self {
        let info = info(mission);
        Self {
            path,
            file_bytes: Some(info.bags.iter().map(|bag| bag.file_bytes).sum()),
            is_complete: !mission.notices.any_loss(),
            error: None,
            info: Some(info),
        }
    }
}

const COLUMNS: &[ColumnOf<(), SurveyRow>] = columns! {
    "path" Text |(), row| TableCell::text(&row.path);
    "bag_format" Text |(), row| of_bag(row, |bag| TableCell::text(&bag.format));
    "compression" Text |(), row| of_bag(row, |bag| TableCell::text(bag.compression.join(" ")));
    "tier" Text |(), row| of_bag(row, |bag| TableCell::text(bag.tier.word()));
    "is_complete" FLAG |(), row| TableCell::Flag(row.is_complete);
    "file_bytes" I64 |(), row| TableCell::known(row.file_bytes, TableCell::count);
    "start_ns" Time |(), row| known(row, |info| TableCell::Time(Stamp(info.start_ns)));
    "duration_s" F64 |(), row| known(row, |info| TableCell::Float(info.duration_s));
    "messages" I64 |(), row| known(row, |info| TableCell::count(info.messages));
    "topics" I64 |(), row| known(row, |info| TableCell::count(info.topics.len()));
    "nodes" I64 |(), row| known(row, |info| TableCell::count(info.nodes_by_degree.total()));
    "publishes" I64 |(), row| known(row, |info| TableCell::count(info.publishes_by_degree.total()));
    "subscribes" I64 |(), row| known(row, |info| TableCell::count(info.subscribes_by_degree.total()));
    "nodes_measured" I64 |(), row| known(row, |info| TableCell::count(info.nodes_by_degree.measured));
    "publishes_measured" I64 |(), row| known(row, |info| TableCell::count(info.publishes_by_degree.measured));
    "subscribes_measured" I64 |(), row| known(row, |info| TableCell::count(info.subscribes_by_degree.measured));
    "subscribes_stated" I64 |(), row| known(row, |info| TableCell::count(info.subscribes_by_degree.stated));
    "named_nodes" I64 |(), row| known(row, |info| TableCell::count(info.nodes.iter().filter(|node| is_named(node)).count()));
    "unknown_publishers" I64 |(), row| known(row, unknown_publishers);
    "changes" I64 |(), row| known(row, |info| TableCell::count(info.changes.all));
    "starts" I64 |(), row| known(row, |info| TableCell::count(info.changes.starts));
    "stops" I64 |(), row| known(row, |info| TableCell::count(info.changes.stops));
    "restarts" I64 |(), row| known(row, |info| TableCell::count(info.changes.restarts));
    "rates" I64 |(), row| known(row, |info| TableCell::count(info.changes.rates));
    "evidence" Text |(), row| known(row, |info| TableCell::text(evidence(info)));
    "error" Text |(), row| TableCell::known(row.error.as_deref(), TableCell::text);
};

/// The survey as a table, a row per bag, readable or not.
pub(crate) fn survey_table(rows: &[SurveyRow]) -> Batch {
    Batch::filled(COLUMNS, &(), rows)
}

/// A cell of the summary; unknown if there is none.
fn known<'a>(row: &'a SurveyRow, cell: fn(&'a Info) -> TableCell<'a>) -> TableCell<'a> {
    TableCell::known(row.info.as_ref(), cell)
}

fn of_bag<'a>(row: &'a SurveyRow, cell: fn(&'a Report) -> TableCell<'a>) -> TableCell<'a> {
    let info = row.info.as_ref();
    TableCell::known(info.and_then(|info| info.bags.first()), cell)
}

/// Whether a node is a named node of the robot.
fn is_named(node: &NodeInfo) -> bool {
    let mut evidence = node.evidence.iter();
    let is_guess = evidence.all(|word| Evidence::of(word).is_guess());
    !is_guess && !is_recorder(&node.name) && !is_player(&node.name)
}

fn unknown_publishers(info: &Info) -> TableCell<'_> {
    // Messages of which no publisher is known have at least one.
    let least = |topic: &TopicInfo| u32::from(topic.count > 0 && topic.publishers.is_empty());
    let of = |topic: &TopicInfo| topic.unknown_publishers.unwrap_or(0).max(least(topic));
    TableCell::count(info.topics.iter().map(of).sum::<u32>())
}

fn evidence(info: &Info) -> String {
    words::joined(info.evidence.iter().map(|e| e.source), " ")
}

/// The survey as a table for people, fitted to `width`; the line of an unreadable bag has the reason.
pub fn survey_text(rows: &[SurveyRow], width: Option<usize>) -> String {
    let column = |head, is_right, least, goes| Column::new(head, is_right, least, (goes, goes));
    let columns = [
        column("bag", false, width.unwrap_or(0).clamp(60, 144) / 3, 0),
        column("format", false, WHOLE, 4),
        column("size", true, WHOLE, 5),
        column("start", false, WHOLE, 7),
        column("span", true, WHOLE, 0),
        column("messages", true, WHOLE, 0),
        column("topics", true, WHOLE, 6),
        column("nodes", true, WHOLE, 0),
        column("pub", true, WHOLE, 2),
        column("sub", true, WHOLE, 3),
        column("starts", true, WHOLE, 2),
        column("stops", true, WHOLE, 2),
        column("restarts", true, WHOLE, 6),
        column("rates", true, WHOLE, 2),
        column("evidence", false, 12, 1),
    ];
    let read: Vec<Vec<Cell>> = rows.iter().filter_map(|row| text_row(row, width)).collect();
    let mut out = table(&columns, &read, width);
    for row in rows {
        if let Some(error) = &row.error {
            let lead = format!("  {}  ", visible(&row.path));
            out.push_str(&hang(&lead, &visible(error), 4, width));
        }
    }
    out
}

/// The row of a bag that was read; a narrow one has its date alone, or without seconds.
fn text_row(row: &SurveyRow, width: Option<usize>) -> Option<Vec<Cell>> {
    let date = match width {
        Some(0..96) => "YYYY-MM-DD",
        Some(96..112) => "YYYY-MM-DDTHH:MM",
        _ => "YYYY-MM-DDTHH:MM:SS",
    };
    let info = row.info.as_ref().filter(|_| row.error.is_none())?;
    let bag = info.bags.first();
    let start = Stamp(info.start_ns).to_string();
    let cells = [
        visible(&row.path).into_owned(),
        bag.map(|b| b.format.clone()).unwrap_or_default(),
        row.file_bytes.map(words::bytes).unwrap_or_default(),
        start.chars().take(date.len()).collect(),
        words::offset_seconds(info.end_ns.saturating_sub(info.start_ns)),
        info.messages.to_string(),
        info.topics.len().to_string(),
        info.nodes_by_degree.total().to_string(),
        info.publishes_by_degree.total().to_string(),
        info.subscribes_by_degree.total().to_string(),
        info.changes.starts.to_string(),
        info.changes.stops.to_string(),
        info.changes.restarts.to_string(),
        info.changes.rates.to_string(),
        evidence(info),
    ];
    Some(cells.into_iter().map(Cell::Text).collect())
}
