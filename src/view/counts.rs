//! How many changes of each kind a window shows.

use super::items::Viewed;
use super::{Counts, Mark, Shown};

/// Counts the marks of one window's items and arrows. Edges count where both their ends stayed: one that comes or
/// goes with its node or topic is told by that.
pub(crate) fn tally(viewed: &Viewed, items: &[Shown], arrows: &[Shown]) -> Counts {
    let mut tally = Counts::default();
    let mut stayed = vec![false; viewed.items.len()];
    for shown in items {
        let Some(item) = viewed.items.get(shown.id as usize) else {
            continue;
        };
        let is_node = item.kind.word() == "node";
        match shown.mark {
            Some(Mark::Added) if is_node => tally.nodes_added += 1,
            Some(Mark::Removed) if is_node => tally.nodes_removed += 1,
            Some(Mark::Added) => tally.topics_added += 1,
            Some(Mark::Removed) => tally.topics_removed += 1,
            Some(Mark::Faster | Mark::Slower) => tally.rates += 1,
            Some(_) => tally.others += 1,
            None => {}
        }
        stayed[shown.id as usize] = !matches!(shown.mark, Some(Mark::Added | Mark::Removed));
    }
    for shown in arrows {
        let Some(arrow) = viewed.arrows.get(shown.id as usize) else {
            continue;
        };
        let at = |id: u32| stayed.get(id as usize) == Some(&true);
        let stayed = at(arrow.from) && at(arrow.to);
        match shown.mark {
            Some(Mark::Added) if stayed => tally.edges_added += 1,
            Some(Mark::Removed) if stayed => tally.edges_removed += 1,
            // Between nodes there is no topic to show the change.
            Some(Mark::Faster | Mark::Slower) if !viewed.pairs.is_empty() => tally.rates += 1,
            _ => {}
        }
    }
    tally
}
