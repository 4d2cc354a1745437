//! Judgements of missions: compared with each other, written down as an expectation, held against one.
//!
//! Everything here judges lives, rates and the ledger, never the difference of two windows. An element without evidence
//! in the bag is not absent: it is undecidable, and reported as such.

mod baseline;
mod difference;
mod expectation;
mod facts;
mod finding;
mod judge;
mod measure;
mod pattern;
mod range;
mod report;

pub(crate) use baseline::{Written, update, write};
pub(crate) use difference::{
    DIFF_FORMATS, DiffFormat, DiffSubject, Difference, Side, differences, pairs, union,
};
pub(crate) use expectation::{Expectation, read};
pub(crate) use finding::{FindingKind, Severity};
pub(crate) use judge::{Verdict, judge};
pub(crate) use report::{FORMATS, Format, Subject, explain};
