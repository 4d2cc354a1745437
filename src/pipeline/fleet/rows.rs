//! The two tables of a fleet: their columns and cells.

use super::counts::{Count, FleetBag, SCHEMA_VERSION};
use crate::base::role::role;
use crate::base::table::{Batch, ColumnKind, ColumnOf, TableCell, columns};
use crate::base::time::Stamp;

/// The column of a node's name without its anonymous suffix.
#[cfg(feature = "arrow")]
pub(super) const ROLE: &str = "node_role";

pub(super) const COUNTS: &[ColumnOf<(), Count>] = columns! {
    "mission" Text |(), count| TableCell::text(&*count.mission);
    "bag" Text |(), count| TableCell::text(&*count.bag);
    "format" Text |(), count| TableCell::text(&*count.format);
    "period_ns" I64 |(), count| TableCell::Int(count.period.nanos());
    "win" I64 |(), count| TableCell::Int(count.win);
    "start_ns" I64 |(), count| nanos(count.start);
    "end_ns" I64 |(), count| nanos(count.start.plus(count.period.nanos()));
    "topic" Text |(), count| TableCell::text(&*count.topic);
    "type" Text |(), count| TableCell::text(&*count.type_name);
    "node" Text |(), count| text(count.node.as_deref());
    "node_role" Text |(), count| text(count.node.as_deref().map(role));
    "n" I64 |(), count| TableCell::count(count.n);
    "bytes" I64 |(), count| TableCell::known(count.bytes, TableCell::count);
    "first_ns" I64 |(), count| TableCell::known(count.first, nanos);
    "last_ns" I64 |(), count| TableCell::known(count.last, nanos);
    "max_gap_ns" I64 |(), count| TableCell::known(count.max_gap_ns, TableCell::Int);
};

const BAGS: &[ColumnOf<(), FleetBag>] = columns! {
    "uri" Text |(), bag| TableCell::text(&*bag.uri);
    "mission" Text |(), bag| TableCell::text(&*bag.mission);
    "file_bytes" I64 |(), bag| TableCell::known(bag.file_bytes, TableCell::count);
    "format" Text |(), bag| text(bag.format.as_deref());
    "tier" Text |(), bag| TableCell::known(bag.tier, |tier| TableCell::text(tier.word()));
    "is_complete" Flag |(), bag| TableCell::Flag(bag.is_complete);
    "messages" I64 |(), bag| TableCell::count(bag.messages);
    "content" Text |(), bag| text(bag.content.as_deref());
    "start_ns" I64 |(), bag| TableCell::known(bag.span, |span| nanos(span.start));
    "end_ns" I64 |(), bag| TableCell::known(bag.span, |span| nanos(span.end));
    "period_ns" I64 |(), bag| TableCell::Int(bag.period.nanos());
    "origin_ns" I64 |(), bag| nanos(bag.origin);
    "lost" Text |(), bag| text(bag.lost.as_deref());
    "error" Text |(), bag| text(bag.error.as_deref());
    "bagreel" Text |(), _| TableCell::text(env!("CARGO_PKG_VERSION"));
    "schema_version" I64 |(), _| TableCell::Int(SCHEMA_VERSION);
};

/// The counts as a table.
pub(crate) fn counts_table(counts: &[Count]) -> Batch {
    Batch::filled(COUNTS, &(), counts)
}

/// The bags as a table.
pub(crate) fn bags_table(bags: &[FleetBag]) -> Batch {
    Batch::filled(BAGS, &(), bags)
}

fn nanos(stamp: Stamp) -> TableCell<'static> {
    TableCell::Int(stamp.0)
}

fn text(text: Option<&str>) -> TableCell<'_> {
    TableCell::known(text, TableCell::text)
}
