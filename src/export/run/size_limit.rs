//! `--max-bytes`: drops resolution, then windows, until an animation is small enough.

use super::{Progress, pass};
use crate::base::error::{Error, Result};
use crate::base::words;
use crate::export::sequence::{Sequence, SequenceOptions};
use crate::export::{Output, Written};

/// Scales that are tried while all windows are shown.
const SCALES: [f64; 4] = [0.85, 0.7, 0.6, 0.5];
/// Steps between shown windows that are tried, at the smallest of these scales.
const EVERY: [usize; 4] = [2, 3, 5, 10];
/// Scales that are tried when only changes are shown.
const LAST_SCALES: [f64; 4] = [0.5, 0.35, 0.25, 0.15];

/// Writes `output` within `max_bytes`; a remark reports what was dropped.
///
/// # Errors
/// [`Error::Output`] if nothing is small enough; otherwise as [`super::run`].
pub(crate) fn fit(
    sequence: &Sequence<'_>,
    output: &Output,
    progress: &mut Progress<'_>,
) -> Result<Written> {
    for options in steps(&sequence.options) {
        let mut smaller = sequence.clone();
        smaller.options = options;
        let outcome = pass(&smaller, std::slice::from_ref(output), progress)?;
        if let Some(Some(mut written)) = outcome.into_iter().next() {
            written
                .remarks
                .push(given_up(&sequence.options, &smaller.options));
            return Ok(written);
        }
    }
    let most = words::bytes(sequence.options.max_bytes.unwrap_or(0));
    let reason = format!("it does not fit in {most}, even small and with changes only");
    let hint = "raise `--max-bytes`, or show less: a longer `--period`, `--ns-filter`";
    Err(Error::output(output.target.path(), reason, hint))
}

/// The options that are tried, in order.
fn steps(asked: &SequenceOptions) -> Vec<SequenceOptions> {
    let scaled = |by: f64| SequenceOptions {
        scale: asked.scale * by,
        ..asked.clone()
    };
    let mut steps = SCALES.map(scaled).to_vec();
    let smallest = scaled(SCALES[SCALES.len() - 1]);
    steps.extend(EVERY.map(|every| SequenceOptions {
        every,
        ..smallest.clone()
    }));
    steps.extend(LAST_SCALES.map(|by| SequenceOptions {
        changes_only: true,
        ..scaled(by)
    }));
    steps
}

/// What was dropped between `asked` and `now`, as text.
fn given_up(asked: &SequenceOptions, now: &SequenceOptions) -> String {
    let mut words = Vec::new();
    if now.scale < asked.scale {
        words.push(format!(
            "scaled to {:.0} %",
            now.scale / asked.scale * 100.0
        ));
    }
    if now.changes_only {
        words.push("showed only the windows with a change".to_owned());
    } else if now.every > asked.every {
        words.push(format!(
            "showed one of every {} windows, and all with a change",
            now.every
        ));
    }
    let most = now.max_bytes.unwrap_or(0);
    format!("{} to stay within {most} bytes", words.join(", "))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn size_goes_first_then_windows() {
        let asked = SequenceOptions {
            max_bytes: Some(5000),
            ..SequenceOptions::default()
        };
        let steps = steps(&asked);
        assert!(steps.iter().all(|s| s.scale < 1.0));
        let first_left_out = steps.iter().position(|s| s.every > 1).unwrap();
        assert!(steps[..first_left_out].iter().any(|s| s.scale <= 0.5));
        assert!(steps[steps.len() - 1].changes_only);
    }

    #[test]
    fn reductions_are_reported() {
        let asked = SequenceOptions {
            max_bytes: Some(5000),
            ..SequenceOptions::default()
        };
        let now = SequenceOptions {
            scale: 0.7,
            ..asked.clone()
        };
        let expected = "scaled to 70 % to stay within 5000 bytes";
        assert_eq!(given_up(&asked, &now), expected);
    }
}
