//! One row per bag of a folder: format, span, topics, nodes, edges by degree, evidence.

use serde::Serialize;

use super::{Info, NodeInfo, info};
use crate::base::columns::{Cell, Column, WHOLE, hang, table};
use crate::base::name::{is_player, is_recorder};
use crate::base::table::{Batch, ColumnKind, TableCell};
use crate::base::time::Stamp;
use crate::base::words::{self, visible};
use crate::evidence::Evidence;
use crate::mission::Mission;

/// A bag in a survey.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct SurveyRow {
    /// The path relative to the folder surveyed.
    pub path: String,
    /// Its size in bytes; `None` where that is not known.
    pub file_bytes: Option<u64>,
    /// Whether nothing of it was lost; an empty bag may be a whole one.
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

const COLUMNS: &[(&str, ColumnKind)] = &[
    ("path", ColumnKind::Text),
    ("bag_format", ColumnKind::Text),
    ("compression", ColumnKind::Text),
    ("tier", ColumnKind::Text),
    ("is_complete", ColumnKind::Flag),
    ("file_bytes", ColumnKind::I64),
    ("start_ns", ColumnKind::Time),
    ("duration_s", ColumnKind::F64),
    ("messages", ColumnKind::I64),
    ("topics", ColumnKind::I64),
    ("nodes", ColumnKind::I64),
    ("publishes", ColumnKind::I64),
    ("subscribes", ColumnKind::I64),
    ("nodes_measured", ColumnKind::I64),
    ("publishes_measured", ColumnKind::I64),
    ("subscribes_measured", ColumnKind::I64),
    ("subscribes_stated", ColumnKind::I64),
    ("named_nodes", ColumnKind::I64),
    ("unknown_publishers", ColumnKind::I64),
    ("evidence", ColumnKind::Text),
    ("error", ColumnKind::Text),
];

/// The place of the column `is_complete`, behind which `file_bytes` stands.
const COMPLETE: usize = 4;

/// The survey as a table, a row per bag, readable or not.
pub(crate) fn survey_table(rows: &[SurveyRow]) -> Batch {
    let mut table = Batch::new(COLUMNS);
    for row in rows {
        table.push(&cells(row));
    }
    table
}

fn cells(row: &SurveyRow) -> Vec<TableCell<'_>> {
    let path = TableCell::text(&row.path);
    let Some(info) = &row.info else {
        let mut cells = vec![TableCell::Null; COLUMNS.len()];
        cells[0] = path;
        cells[COMPLETE] = TableCell::Flag(row.is_complete);
        cells[COMPLETE + 1] = TableCell::known(row.file_bytes, TableCell::count);
        cells[COLUMNS.len() - 1] = TableCell::known(row.error.as_deref(), TableCell::text);
        return cells;
    };
    let bag = info.bags.first();
    let evidence: Vec<&str> = info.evidence.iter().map(|e| e.source).collect();
    let is_named = |node: &&NodeInfo| {
        let is_guess = node
            .evidence
            .iter()
            .all(|word| Evidence::of(word).is_guess());
        !is_guess && !is_recorder(&node.name) && !is_player(&node.name)
    };
    let named = info.nodes.iter().filter(is_named).count();
    let unknown: u32 = info
        .topics
        .iter()
        .filter_map(|t| t.unknown_publishers)
        .sum();
    vec![
        path,
        TableCell::known(bag, |b| TableCell::text(&b.format)),
        TableCell::known(bag, |b| TableCell::text(b.compression.join(" "))),
        TableCell::known(bag, |b| TableCell::text(b.tier)),
        TableCell::Flag(row.is_complete),
        TableCell::known(row.file_bytes, TableCell::count),
        TableCell::Time(Stamp(info.start_ns)),
        TableCell::Float(info.duration_s),
        TableCell::count(info.messages),
        TableCell::count(info.topics.len()),
        TableCell::count(info.nodes_by_degree.total()),
        TableCell::count(info.publishes_by_degree.total()),
        TableCell::count(info.subscribes_by_degree.total()),
        TableCell::count(info.nodes_by_degree.measured),
        TableCell::count(info.publishes_by_degree.measured),
        TableCell::count(info.subscribes_by_degree.measured),
        TableCell::count(info.subscribes_by_degree.stated),
        TableCell::count(named),
        TableCell::count(unknown),
        TableCell::text(evidence.join(" ")),
        TableCell::known(row.error.as_deref(), TableCell::text),
    ]
}

/// The survey as a table for people, fitted to `width`; a bag that cannot be read has a line that says why.
pub fn survey_text(rows: &[SurveyRow], width: Option<usize>) -> String {
    let column = |head, is_right, least, goes| Column {
        head,
        is_right,
        least,
        gives: (goes, goes),
    };
    let columns = [
        column("bag", false, 20, 0),
        column("format", false, WHOLE, 4),
        column("size", true, WHOLE, 0),
        column("start", false, 10, 5),
        column("span", true, WHOLE, 0),
        column("messages", true, WHOLE, 0),
        column("topics", true, WHOLE, 0),
        column("nodes", true, WHOLE, 0),
        column("pub", true, WHOLE, 2),
        column("sub", true, WHOLE, 3),
        column("evidence", false, 12, 1),
    ];
    let read: Vec<Vec<Cell>> = rows.iter().filter_map(text_row).collect();
    let mut out = String::new();
    if !read.is_empty() {
        out = table(&columns, &read, width);
    }
    for row in rows {
        if let Some(error) = &row.error {
            let lead = format!("  {}  ", visible(&row.path));
            out.push_str(&hang(&lead, &visible(error), 4, width));
        }
    }
    out
}

/// The row of a bag that was read.
fn text_row(row: &SurveyRow) -> Option<Vec<Cell>> {
    let info = row.info.as_ref().filter(|_| row.error.is_none())?;
    let bag = info.bags.first();
    let evidence: Vec<&str> = info.evidence.iter().map(|e| e.source).collect();
    let cells = [
        visible(&row.path).into_owned(),
        bag.map(|b| b.format.clone()).unwrap_or_default(),
        row.file_bytes.map(words::bytes).unwrap_or_default(),
        Stamp(info.start_ns).to_string().chars().take(19).collect(),
        words::offset_seconds(info.end_ns.saturating_sub(info.start_ns)),
        info.messages.to_string(),
        info.topics.len().to_string(),
        info.nodes_by_degree.total().to_string(),
        info.publishes_by_degree.total().to_string(),
        info.subscribes_by_degree.total().to_string(),
        evidence.join(" "),
    ];
    Some(cells.into_iter().map(Cell::Text).collect())
}
