//! Checks of missions: compares them with each other, generates expectations, and checks against them.
//!
//! Everything here is based on lifetimes, rates and the event log, never on the difference of two windows. An element
//! without evidence in the bag is not absent but undecidable, and reported as such.

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
pub(crate) use judge::{Judgement, Verdict, judge};
pub(crate) use report::{FORMATS, Format, Subject, explain};
