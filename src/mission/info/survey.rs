//! One row per bag of a folder: format, span, topics, nodes, edges by degree, evidence.

use serde::Serialize;

use super::Info;
use crate::base::csv::table;
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

const COLUMNS: [&str; 19] = [
    "path",
    "bag_format",
    "compression",
    "tier",
    "is_complete",
    "file_bytes",
    "start_ns",
    "duration_s",
    "messages",
    "topics",
    "nodes",
    "publishes",
    "subscribes",
    "nodes_measured",
    "publishes_measured",
    "subscribes_measured",
    "subscribes_stated",
    "evidence",
    "error",
];

/// The survey as CSV, a row per bag, readable or not.
pub fn survey_csv(rows: &[SurveyRow]) -> String {
    table(&COLUMNS, rows.iter().map(csv_row))
}

fn csv_row(row: &SurveyRow) -> Vec<String> {
    let Some(info) = &row.info else {
        let mut cells = vec![String::new(); COLUMNS.len()];
        cells[0].clone_from(&row.path);
        cells[18] = row.error.clone().unwrap_or_default();
        return cells;
    };
    let bag = info.bags.first();
    let told = |of: &dyn Fn(&super::BagInfo) -> String| bag.map(of).unwrap_or_default();
    let evidence: Vec<&str> = info.evidence.iter().map(|e| e.source).collect();
    vec![
        row.path.clone(),
        told(&|b| b.format.clone()),
        told(&|b| b.compression.join(" ")),
        told(&|b| b.tier.to_owned()),
        told(&|b| b.complete.to_string()),
        told(&|b| b.file_bytes.to_string()),
        info.start_ns.to_string(),
        info.duration_s.to_string(),
        info.messages.to_string(),
        info.topics.len().to_string(),
        info.nodes_by_degree.total().to_string(),
        info.publishes_by_degree.total().to_string(),
        info.subscribes_by_degree.total().to_string(),
        info.nodes_by_degree.measured.to_string(),
        info.publishes_by_degree.measured.to_string(),
        info.subscribes_by_degree.measured.to_string(),
        info.subscribes_by_degree.stated.to_string(),
        evidence.join(" "),
        String::new(),
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
