//! `--verify`: reads everything again with an independent reader and compares the counts.

use std::collections::BTreeSet;

use super::collect::{Collected, collect};
use super::{Reading, Stage, Watch};
use crate::bag::{Report, Tier};
use crate::base::error::{Error, Result};
use crate::base::notice::{Notice, NoticeKind};
use crate::base::time::Span;
use crate::graph::window::divide;
use crate::graph::{TopicCount, counts};

/// The outcome of a second reading of the bags.
pub(super) struct Verified {
    pub(super) reports: Vec<Report>,
    pub(super) notices: Vec<Notice>,
}

/// Reads the bags again and compares the counts of both readings.
///
/// # Errors
/// If the user stops it; a bag that cannot be read again is a notice.
pub(super) fn verify(
    first: &Collected,
    reading: &Reading,
    watch: &mut dyn Watch,
) -> Result<Verified> {
    watch.stage(Stage::Verify);
    let second = collect(&mut reading.clone(), true, watch);
    match second.and_then(|second| compare(first, &second, reading)) {
        Err(why) if !matches!(why, Error::Interrupted) => {
            let text = format!("the bag could not be verified: {why}");
            Ok(Verified {
                reports: first.reports.clone(),
                notices: vec![Notice::new(NoticeKind::Damaged, text)],
            })
        }
        other => other,
    }
}

/// The notices about differing counts, and about bags that could not be verified.
fn compare(first: &Collected, second: &Collected, reading: &Reading) -> Result<Verified> {
    let windows = divide(&reading.division, first.range)?;
    let ours = counted(first, &windows.spans)?;
    let theirs = counted(second, &windows.spans)?;
    let differing = ours.symmetric_difference(&theirs).count();
    let messages = |all: &BTreeSet<TopicCount>| all.iter().map(|c| c.count).sum::<u64>();
    let (messages, theirs) = (messages(&ours), messages(&theirs));
    let same = messages == theirs && differing == 0;
    let mut notices = unverified(first, second);
    let is_other = notices.is_empty();
    let reader = if is_other { "reader" } else { "reading" };
    notices.push(if same {
        let text = format!("a second {reader} counts the same {messages} messages");
        Notice::new(NoticeKind::Note, text)
    } else {
        let text = format!(
            "a second reader counts {theirs} messages instead of {messages}; {differing} counts of topics in windows differ"
        );
        Notice::new(NoticeKind::Damaged, text)
    });
    let lost = second.recorded.notices.iter().filter(|n| n.kind.is_loss());
    notices.extend(lost);
    let report = |(report, again): (&Report, &Report)| Report {
        complete: report.complete && again.complete,
        tier: Tier::Verify,
        ..report.clone()
    };
    let both = first.reports.iter().zip(&second.reports);
    Ok(Verified {
        reports: both.map(report).collect(),
        notices,
    })
}

fn counted(collected: &Collected, windows: &[Span]) -> Result<BTreeSet<TopicCount>> {
    Ok(counts(&collected.recorded, windows)?.into_iter().collect())
}

/// The notices about bags that could not be verified completely.
fn unverified(first: &Collected, second: &Collected) -> Vec<Notice> {
    let both = first.reports.iter().zip(&second.reports);
    let notice = |(bag, again): (&Report, &Report)| {
        let why = again.tier_reason.as_ref()?;
        // A reader that fails at the start implies nothing about the bag; one that stops has found damage.
        let kind = if again.complete {
            NoticeKind::Note
        } else {
            NoticeKind::Damaged
        };
        let text = format!("`{}` could not be verified: {why}", bag.name);
        Some(Notice::new(kind, text))
    };
    both.filter_map(notice).collect()
}
