//! All windows as one: what a still picture of the whole mission shows.

use crate::base::time::Span;
use crate::view::{Counts, Frame, Shown, View};

/// The whole sequence as one window without marks: everything that was ever there, in its liveliest state, with rates
/// averaged over the whole time and messages summed. `None` for a view without windows.
pub(crate) fn union(view: &View) -> Option<Frame> {
    let (first, last) = (view.frames.first()?, view.frames.last()?);
    let mut items = vec![None; view.items.len()];
    let mut arrows = vec![None; view.arrows.len()];
    let mut whole = 0.0;
    for frame in &view.frames {
        let length = frame.span.nanos() as f64;
        whole += length;
        for shown in &frame.items {
            gather(&mut items, shown, length);
        }
        for shown in &frame.arrows {
            gather(&mut arrows, shown, length);
        }
    }
    let average = |all: Vec<Option<Shown>>| {
        let mut all: Vec<Shown> = all.into_iter().flatten().collect();
        for shown in &mut all {
            shown.hz = shown
                .hz
                .map(|sum| if whole > 0.0 { sum / whole } else { 0.0 });
            shown.steady_hz = shown.hz;
        }
        all
    };
    Some(Frame {
        index: 0,
        span: Span {
            start: first.span.start,
            end: last.span.end,
        },
        partial: false,
        messages: view.frames.iter().map(|f| f.messages).sum(),
        items: average(items),
        arrows: average(arrows),
        headlines: Vec::new(),
        counts: Counts::default(),
        caption: Vec::new(),
    })
}

/// Adds a window of this length in nanoseconds; rates become sums over time.
fn gather(all: &mut [Option<Shown>], shown: &Shown, length: f64) {
    let Some(slot) = all.get_mut(shown.id as usize) else {
        return;
    };
    let Some(sum) = slot else {
        *slot = Some(Shown {
            mark: None,
            hz: shown.hz.map(|hz| hz * length),
            rates: None,
            entries: Vec::new(),
            inside: None,
            lifecycle: None,
            ..shown.clone()
        });
        return;
    };
    sum.state = sum.state.min(shown.state);
    sum.degree = sum.degree.min(shown.degree);
    sum.hz = match (sum.hz, shown.hz) {
        (sum, Some(hz)) => Some(sum.unwrap_or(0.0) + hz * length),
        (sum, None) => sum,
    };
    sum.count = match (sum.count, shown.count) {
        (sum, Some(count)) => Some(sum.unwrap_or(0).saturating_add(count)),
        (sum, None) => sum,
    };
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::view::testing::mission;
    use crate::view::{ViewOptions, view};

    #[test]
    fn rates_are_averaged_over_the_whole_time() {
        let (view, _) = view(
            &mission(&["/a>/t@4", "/a", "/a>/t@2 /b", "/a"]),
            &ViewOptions::default(),
        );
        let all = union(&view).unwrap();
        assert_eq!((all.items.len(), all.arrows.len()), (3, 1));
        assert_eq!(
            (all.arrows[0].hz, all.arrows[0].count),
            (Some(1.5), Some(6))
        );
        assert!(all.items.iter().all(|s| s.mark.is_none()));
        assert!(union(&View::default()).is_none());
    }
}
