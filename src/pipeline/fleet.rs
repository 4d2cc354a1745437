//! Many bags as two tables: counts of each bag, merged counts, and the mission computed from them.
//!
//! ```text
//! plan ──> count (each bag, or each part of its time, anywhere) ──> merge ──> finish (each mission)
//! ```
//!
//! A [`FleetPlan`] lists the bags and fixes where windows begin, before anything is counted. [`count()`] is a pure
//! function of one bag and reads its index only. [`merge`] combines the counts of the parts of a bag.
//! [`finish()`] makes the [`Mission`](crate::Mission) of one mission's counts: states, changes and all that needs the
//! whole.

#[cfg(feature = "arrow")]
pub mod arrow;
mod count;
mod counts;
mod finish;
mod plan;
#[cfg(feature = "parquet")]
mod rows;
#[cfg(feature = "parquet")]
mod run;

pub use count::{CountedBag, Tally, count};
pub use counts::{Count, FleetBag, SCHEMA_VERSION, merge};
pub use finish::finish;
pub use plan::{CountDetail, FleetPlan, PlannedBag, Planning, plan};
#[cfg(feature = "parquet")]
pub use run::{FleetJob, OnError, Tabled, tables};
