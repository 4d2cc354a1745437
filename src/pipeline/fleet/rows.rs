//! The two tables of a fleet: their columns and cells.

use super::counts::{Count, FleetBag, SCHEMA_VERSION};
use crate::base::role::role;
use crate::base::table::{Batch, ColumnKind, TableCell};
use crate::base::time::Stamp;

/// The column of a node's name without what is new in every run.
pub(super) const ROLE: &str = "node_role";

pub(super) const COUNTS: &[(&str, ColumnKind)] = &[
    ("mission", ColumnKind::Text),
    ("bag", ColumnKind::Text),
    ("format", ColumnKind::Text),
    ("period_ns", ColumnKind::I64),
    ("win", ColumnKind::I64),
    ("start_ns", ColumnKind::I64),
    ("end_ns", ColumnKind::I64),
    ("topic", ColumnKind::Text),
    ("type", ColumnKind::Text),
    ("node", ColumnKind::Text),
    (ROLE, ColumnKind::Text),
    ("n", ColumnKind::I64),
    ("bytes", ColumnKind::I64),
    ("first_ns", ColumnKind::I64),
    ("last_ns", ColumnKind::I64),
    ("max_gap_ns", ColumnKind::I64),
];

/// A time as a number: engines without nanoseconds (Spark) would cut a timestamp.
fn nanos(stamp: Stamp) -> TableCell<'static> {
    TableCell::Int(stamp.0)
}

/// The counts as a table.
pub(crate) fn counts_table(counts: &[Count]) -> Batch {
    let mut table = Batch::new(COUNTS);
    for count in counts {
        table.push(&[
            TableCell::text(&*count.mission),
            TableCell::text(&*count.bag),
            TableCell::text(&*count.format),
            TableCell::Int(count.period.nanos()),
            TableCell::Int(count.win),
            nanos(count.start),
            nanos(count.start.plus(count.period.nanos())),
            TableCell::text(&*count.topic),
            TableCell::text(&*count.type_name),
            TableCell::known(count.node.as_deref(), TableCell::text),
            TableCell::known(count.node.as_deref().map(role), TableCell::text),
            TableCell::count(count.n),
            TableCell::known(count.bytes, TableCell::count),
            TableCell::known(count.first, nanos),
            TableCell::known(count.last, nanos),
            TableCell::known(count.max_gap_ns, TableCell::Int),
        ]);
    }
    table
}

const BAGS: &[(&str, ColumnKind)] = &[
    ("uri", ColumnKind::Text),
    ("mission", ColumnKind::Text),
    ("etag", ColumnKind::Text),
    ("file_bytes", ColumnKind::I64),
    ("format", ColumnKind::Text),
    ("tier", ColumnKind::Text),
    ("is_complete", ColumnKind::Flag),
    ("messages", ColumnKind::I64),
    ("start_ns", ColumnKind::I64),
    ("end_ns", ColumnKind::I64),
    ("period_ns", ColumnKind::I64),
    ("origin_ns", ColumnKind::I64),
    ("lost", ColumnKind::Text),
    ("error", ColumnKind::Text),
    ("bagreel", ColumnKind::Text),
    ("schema_version", ColumnKind::I64),
];

/// The bags as a table.
pub(crate) fn bags_table(bags: &[FleetBag]) -> Batch {
    let mut table = Batch::new(BAGS);
    for bag in bags {
        table.push(&[
            TableCell::text(&*bag.uri),
            TableCell::text(&*bag.mission),
            TableCell::known(bag.etag.as_deref(), TableCell::text),
            TableCell::known(bag.file_bytes, TableCell::count),
            TableCell::known(bag.format.as_deref(), TableCell::text),
            TableCell::known(bag.tier, |tier| TableCell::text(tier.word())),
            TableCell::Flag(bag.is_complete),
            TableCell::count(bag.messages),
            TableCell::known(bag.span, |span| nanos(span.start)),
            TableCell::known(bag.span, |span| nanos(span.end)),
            TableCell::Int(bag.period.nanos()),
            nanos(bag.origin),
            TableCell::known(bag.lost.as_deref(), TableCell::text),
            TableCell::known(bag.error.as_deref(), TableCell::text),
            TableCell::text(env!("CARGO_PKG_VERSION")),
            TableCell::Int(SCHEMA_VERSION),
        ]);
    }
    table
}
