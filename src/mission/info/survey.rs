//! One row per bag of a folder: format, span, topics, nodes, edges by degree, evidence.

use serde::Serialize;

use super::Info;
use crate::base::table::{Batch, Cell, Kind};
use crate::base::time::Stamp;
use crate::base::words::{self, visible};

/// A bag in a survey.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct SurveyRow {
    /// Its path from the folder surveyed.
    pub path: String,
    /// Why it could not be read; everything below is then empty.
    pub error: Option<String>,
    /// What is known of it.
    pub info: Option<Info>,
}

const COLUMNS: &[(&str, Kind)] = &[
    ("path", Kind::Text),
    ("bag_format", Kind::Text),
    ("compression", Kind::Text),
    ("tier", Kind::Text),
    ("is_complete", Kind::Flag),
    ("file_bytes", Kind::I64),
    ("start_ns", Kind::Time),
    ("duration_s", Kind::F64),
    ("messages", Kind::I64),
    ("topics", Kind::I64),
    ("nodes", Kind::I64),
    ("publishes", Kind::I64),
    ("subscribes", Kind::I64),
    ("nodes_measured", Kind::I64),
    ("publishes_measured", Kind::I64),
    ("subscribes_measured", Kind::I64),
    ("subscribes_stated", Kind::I64),
    ("evidence", Kind::Text),
    ("error", Kind::Text),
];

/// The survey as a table, a row per bag, readable or not.
pub(crate) fn survey_table(rows: &[SurveyRow]) -> Batch {
    let mut table = Batch::new(COLUMNS);
    for row in rows {
        table.push(&cells(row));
    }
    table
}

fn cells(row: &SurveyRow) -> Vec<Cell<'_>> {
    let path = Cell::text(&row.path);
    let Some(info) = &row.info else {
        let mut cells = vec![Cell::Null; COLUMNS.len()];
        cells[0] = path;
        cells[COLUMNS.len() - 1] = Cell::known(row.error.as_deref(), Cell::text);
        return cells;
    };
    let bag = info.bags.first();
    let evidence: Vec<&str> = info.evidence.iter().map(|e| e.source).collect();
    vec![
        path,
        Cell::known(bag, |b| Cell::text(&b.format)),
        Cell::known(bag, |b| Cell::text(b.compression.join(" "))),
        Cell::known(bag, |b| Cell::text(b.tier)),
        Cell::known(bag, |b| Cell::Flag(b.complete)),
        Cell::known(bag, |b| Cell::count(b.file_bytes)),
        Cell::Time(Stamp(info.start_ns)),
        Cell::Float(info.duration_s),
        Cell::count(info.messages),
        Cell::count(info.topics.len()),
        Cell::count(info.nodes_by_degree.total()),
        Cell::count(info.publishes_by_degree.total()),
        Cell::count(info.subscribes_by_degree.total()),
        Cell::count(info.nodes_by_degree.measured),
        Cell::count(info.publishes_by_degree.measured),
        Cell::count(info.subscribes_by_degree.measured),
        Cell::count(info.subscribes_by_degree.stated),
        Cell::text(evidence.join(" ")),
        Cell::known(row.error.as_deref(), Cell::text),
    ]
}

/// The survey as aligned text.
pub fn survey_text(rows: &[SurveyRow]) -> String {
    let head = [
        "bag", "format", "size", "start", "span", "messages", "topics", "nodes", "pub", "sub",
        "evidence",
    ];
    let mut lines: Vec<Vec<String>> = vec![head.map(str::to_owned).to_vec()];
    lines.extend(rows.iter().map(text_row));
    let columns = head.len();
    let width = |k: usize| {
        lines
            .iter()
            .filter(|l| l.len() == columns)
            .map(|l| l[k].chars().count())
            .max()
            .unwrap_or(0)
    };
    let widths: Vec<usize> = (0..columns).map(width).collect();
    let line = |cells: &Vec<String>| {
        let padded = cells
            .iter()
            .zip(&widths)
            .map(|(cell, width)| format!("{cell:<width$}"));
        padded.collect::<Vec<_>>().join("  ").trim_end().to_owned() + "\n"
    };
    lines.iter().map(line).collect()
}

fn text_row(row: &SurveyRow) -> Vec<String> {
    let (Some(info), None) = (&row.info, &row.error) else {
        let error = row.error.as_deref().unwrap_or_default();
        return [&row.path, error]
            .map(|text| visible(text).into_owned())
            .into();
    };
    let bag = info.bags.first();
    let evidence: Vec<&str> = info.evidence.iter().map(|e| e.source).collect();
    vec![
        visible(&row.path).into_owned(),
        bag.map(|b| b.format.clone()).unwrap_or_default(),
        bag.map(|b| words::bytes(b.file_bytes)).unwrap_or_default(),
        Stamp(info.start_ns).to_string().chars().take(19).collect(),
        words::offset_seconds(info.end_ns.saturating_sub(info.start_ns)),
        info.messages.to_string(),
        info.topics.len().to_string(),
        info.nodes_by_degree.total().to_string(),
        info.publishes_by_degree.total().to_string(),
        info.subscribes_by_degree.total().to_string(),
        evidence.join(" "),
    ]
}
