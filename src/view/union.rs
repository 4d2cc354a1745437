//! All windows as one, for a still picture of the whole mission.

use crate::view::stable::Lengths;
use crate::view::{Looks, SeenWindow, Shown, TopicRow, View, sum as added};

/// The whole sequence as one window without marks: everything that ever existed, in its most active state,
/// with messages summed, and rates averaged over the windows from the first message to the last. `None` for a view without windows.
pub(crate) fn union(view: &View) -> Option<SeenWindow> {
    view.frames.first()?;
    let lengths = Lengths::new(view.frames.iter().map(|f| f.span));
    let all = |shown: &[Looks]| {
        let whole = shown.iter().filter_map(|looks| whole(looks, &lengths));
        whole.collect()
    };
    Some(SeenWindow {
        items: all(&view.items_shown),
        arrows: all(&view.arrows_shown),
    })
}

/// The look of one item or arrow in all windows together.
pub(super) fn whole(looks: &Looks, lengths: &Lengths) -> Option<Shown> {
    let mut slot = None;
    let (mut first, mut last) = (None, 0);
    for (from, to, _, shown) in looks.spans(lengths.windows()) {
        gather(&mut slot, shown, lengths.of(from, to), u64::from(to - from));
        if shown.hz.is_some_and(|hz| hz > 0.0) {
            (first, last) = (first.or(Some(from)), to);
        }
    }
    let time = first.map_or(0.0, |first| lengths.of(first, last));
    let average = |sum: f64| if time > 0.0 { sum / time } else { 0.0 };
    let sum: Shown = slot?;
    let hz = sum.hz.map(average);
    let row = |row: TopicRow| TopicRow {
        hz: row.hz.map(average),
        ..row
    };
    let topics = sum.topics.iter().cloned().map(row).collect();
    Some(Shown {
        topics,
        hz,
        steady_hz: hz,
        ..sum
    })
}

/// Adds a look that applies to `windows` windows of `length` nanoseconds in total; rates become sums over
/// time.
fn gather(slot: &mut Option<Shown>, shown: &Shown, length: f64, windows: u64) {
    let count = shown.count.map(|count| count.saturating_mul(windows));
    let rows = shown.topics.iter().map(|row| TopicRow {
        hz: row.hz.map(|hz| hz * length),
        count: row.count.map(|count| count.saturating_mul(windows)),
        mark: None,
        rates: None,
        ..row.clone()
    });
    let Some(sum) = slot else {
        *slot = Some(Shown {
            topics: rows.collect(),
            mark: None,
            hz: shown.hz.map(|hz| hz * length),
            rates: None,
            events: Vec::new(),
            inside: None,
            lifecycle: None,
            count,
            ..shown.clone()
        });
        return;
    };
    for row in rows {
        match sum.topics.binary_search_by_key(&row.topic, |r| r.topic) {
            Err(place) => sum.topics.insert(place, row),
            Ok(place) => add_row(&mut sum.topics[place], &row),
        }
    }
    sum.state = sum.state.min(shown.state);
    sum.confidence = sum.confidence.min(shown.confidence);
    sum.is_starved &= shown.is_starved;
    sum.hz = added(sum.hz, shown.hz.map(|hz| hz * length), |a, b| a + b);
    sum.count = added(sum.count, count, u64::saturating_add);
}

fn add_row(sum: &mut TopicRow, row: &TopicRow) {
    sum.ways = [sum.ways[0] | row.ways[0], sum.ways[1] | row.ways[1]];
    sum.state = sum.state.min(row.state);
    sum.is_starved &= row.is_starved;
    sum.hz = added(sum.hz, row.hz, |a, b| a + b);
    sum.count = added(sum.count, row.count, u64::saturating_add);
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::view::testing::mission;
    use crate::view::{ViewOptions, view};

    #[test]
    fn rates_are_averaged_from_the_first_message_to_the_last() {
        let (view, _) = view(
            &mission(&["/a>/t", "/a>/t@4", "/a", "/a>/t@5 /b", "/a"]),
            &ViewOptions::default(),
        );
        let all = union(&view).unwrap();
        assert_eq!((all.items.len(), all.arrows.len()), (3, 1));
        assert_eq!(
            (all.arrows[0].hz, all.arrows[0].count),
            (Some(3.0), Some(9))
        );
        assert!(all.items.iter().all(|s| s.mark.is_none()));
        assert!(union(&View::default()).is_none());
    }
}
