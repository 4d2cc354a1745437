//! Checks of missions: compares them with each other, generates expectations, and checks against them.
//!
//! Everything here is based on lifetimes, rates and the event log, never on the difference of two windows. An element
//! without evidence in the bag is not absent but undecidable, and reported as such.
//!
//! In come missions and a `graph.yaml`; out come a [`Verdict`] or [`Difference`]s, and reports of them. Open `facts` first:
//! what a mission says about a name. `expectation` reads the file, `judge` checks it, `baseline` writes it, `difference`
//! compares two missions, and `report` has the formats.

mod baseline;
mod difference;
mod expectation;
mod facts;
mod finding;
mod judge;
mod report;
mod values;

pub(crate) use baseline::{update, write};
pub use difference::{DiffSubject, Difference, Where};
pub(crate) use difference::{Side, differences, pairs, union};
pub(crate) use expectation::{Expectation, read};
pub use finding::{Cause, Finding, FindingKind, Severity};
pub(crate) use judge::judge;
pub use judge::{CheckedFact, Judgement, Verdict};
pub use report::ReportFormat;
pub(crate) use report::{FORMATS, Subject, explain, unchecked};
