//! Long parts in rows one below the other, like lines of text, so that chains of a hundred layers fit a page.
//!
//! Each row is a separate layout; the edges between rows run through the channels between them.

use super::parts::Subplan;
use super::{Draft, PlacedPart};
use crate::base::geometry::{Point, Rect, Size};
use crate::layout::routes::around::{End, Map};
use crate::layout::spacing::turned;
use crate::layout::{
    Component, Layers, Layout, LayoutOptions, Orientation, PartTask, Plan, Route, pack,
};

/// The aspect, along by across, beyond which a part that does not fit the page is long: in two rows, one of less is
/// higher than it is wide. At 2, drawings are 1 % larger, with 3 % more crossings; at 3.5, 1.5 % smaller, with 4 % fewer.
const LONG: f64 = 2.5;
/// The most rows: with six, no drawing measured changes; with three, they are 0.3 % smaller.
const MOST_ROWS: usize = 12;
/// The most edges from a row to the next: with more of them the rows cannot be read one by one. At 4, drawings are 2 % smaller; at
/// 16, 2 % larger, with 12 % more crossings.
const MOST_CUT: usize = 8;
/// The scale of a sketch divided by that of the drawing with all effort, at least: true of 165 of 169 synthetic parts.
const SKETCHED: f64 = 0.9;
/// The space beside an edge in a channel, and between a channel and the boxes: the length of an arrow's head, and
/// half as much again.
const LANE: f64 = 8.0;
const BESIDE: f64 = 12.0;

/// Whether a placed part is so long that it does not fit the page.
pub(crate) fn is_long(size: Size, task: PartTask<'_>) -> bool {
    let turned = turned(size, task.orientation);
    turned.w > LONG * turned.h && pack::fit(size, task.options.page) < 1.0
}

/// The part in rows, for each number of rows that fits the page better than the previous one; none if it
/// cannot be cut between its namespaces, or is inside one namespace, whose contents can then be cut.
pub(crate) fn wraps(task: PartTask<'_>, layers: &Layers) -> Vec<PlacedPart> {
    let options = task.options;
    let mut found: Vec<PlacedPart> = Vec::new();
    if task.part.root() != 0 {
        return found;
    }
    let fit = |block: &PlacedPart| pack::fit(block.size, options.page);
    let useful = SKETCHED * options.least;
    let sketch = LayoutOptions {
        least: f64::INFINITY,
        ..*options
    };
    for many in 2..=MOST_ROWS {
        let Some(cuts) = cuts(task.part, layers, many) else {
            continue;
        };
        let placed = |options: &LayoutOptions| {
            let rows = Wrapped::new(PartTask { options, ..task }, layers, &cuts)?;
            Some(rows.placed(task.plan, task.part)?.on_page(task.orientation))
        };
        let sketched = (useful > 0.0).then(|| placed(&sketch)).flatten();
        let useless = sketched.filter(|block| fit(block) < useful);
        let Some(block) = useless.or_else(|| placed(options)) else {
            continue;
        };
        // More rows make it narrower and higher: beyond the best number, the search can stop.
        if found.last().is_some_and(|last| fit(last) >= fit(&block)) {
            break;
        }
        found.push(block);
    }
    found
}

/// The first layer of each row but the first: where few edges pass and no namespace is cut, as evenly as
/// possible.
fn cuts(part: &Component, layers: &Layers, many: usize) -> Option<Vec<usize>> {
    let mut passing = vec![0_usize; layers.ranks];
    for &(from, to) in &part.ends {
        let (a, b) = (layers.rank[from], layers.rank[to]);
        for passed in &mut passing[a.min(b) + 1..=a.max(b)] {
            *passed += 1;
        }
    }
    let is_whole = |rank: usize| {
        let mut spans = layers.span.iter().skip(1);
        spans.all(|&(low, high)| rank <= low || rank > high)
    };
    let length = layers.ranks / many;
    let cut = |k: usize| {
        let ideal = k * layers.ranks / many;
        let near = ideal.saturating_sub(length / 3)..=ideal + length / 3;
        let free = near.filter(|&rank| (1..layers.ranks).contains(&rank) && is_whole(rank));
        free.min_by_key(|&rank| (passing[rank], rank.abs_diff(ideal), rank))
            .filter(|&rank| passing[rank] <= MOST_CUT)
    };
    let cuts: Option<Vec<usize>> = (1..many).map(cut).collect();
    cuts.filter(|cuts| cuts.windows(2).all(|pair| pair[0] < pair[1]))
}

/// The rows of a part, each laid out, x along the edges and y across.
struct Wrapped {
    rows: Vec<(Subplan, Layout)>,
    /// The row of each vertex.
    row: Vec<usize>,
    crossings: u64,
}

impl Wrapped {
    fn new(task: PartTask<'_>, layers: &Layers, cuts: &[usize]) -> Option<Self> {
        let (part, orientation) = (task.part, task.orientation);
        let row_of = |v: usize| cuts.partition_point(|&cut| cut <= layers.rank[v]);
        let row: Vec<usize> = (0..part.vertices.len()).map(row_of).collect();
        // A row may be of any length, as it is not wrapped again.
        let endless = LayoutOptions {
            page: Size::new(1e5, 1e5),
            ..*task.options
        };
        let mut rows = Vec::new();
        let mut crossings = 0;
        for at in 0..=cuts.len() {
            let sub = Subplan::new(task.plan, part, 0, |v| row[v] == at);
            let draft = Draft::new(&sub.plan, &endless)?;
            let (crossed, layout) = draft.assembled(orientation);
            crossings += crossed;
            rows.push((sub, lying(layout, orientation)));
        }
        Some(Self {
            rows,
            row,
            crossings,
        })
    }

    /// The rows below each other, with the edges from row to row in the channels between; `None` if a route
    /// is blocked.
    fn placed(&self, plan: &Plan, part: &Component) -> Option<PlacedPart> {
        let mut placed = PlacedPart::unplaced(part);
        let cut: Vec<usize> = (0..part.ends.len())
            .filter(|&link| self.row[part.ends[link].0] != self.row[part.ends[link].1])
            .collect();
        let many = cut.len();
        let mut channels = vec![Channel::default(); self.rows.len()];
        for &link in &cut {
            for channel in self.channels(part.ends[link]) {
                channels[channel].lanes += 1;
            }
        }
        let mut y = 0.0;
        for (at, (sub, layout)) in self.rows.iter().enumerate() {
            sub.put(layout, Point::new(0.0, y), &mut placed);
            y += layout.size.h + BESIDE;
            channels[at].y = y;
            y += BESIDE + LANE * channels[at].lanes as f64;
        }
        let end = |at: usize| End {
            at,
            rect: placed.boxes[at],
            outline: plan.vertices[part.vertices[at]].outline,
        };
        let mut map = Map::new(&placed.boxes);
        let mut margin = 0.0;
        for link in cut {
            let (from, to) = part.ends[link];
            let ways = self.channels((from, to));
            let lanes: Vec<f64> = ways.iter().map(|&c| channels[c].next()).collect();
            if lanes.len() > 1 {
                margin -= LANE;
            }
            let (from, to) = (end(from), end(to));
            let via = via((&from.rect, &to.rect), &lanes, margin - BESIDE);
            placed.routes[link] = map.via(from, to, &via)?;
        }
        // Following an edge through a channel costs a reader as much as a crossing.
        placed.crossings = self.crossings + many as u64;
        Some(placed)
    }

    /// The channels that an edge runs through: the one beyond its first row, and the one before its last if that is
    /// another.
    fn channels(&self, (from, to): (usize, usize)) -> Vec<usize> {
        let (a, b) = (self.row[from], self.row[to]);
        let ways = if a < b { [a, b - 1] } else { [a - 1, b] };
        let mut ways = ways.to_vec();
        ways.dedup();
        ways
    }
}

/// The channel between a row and the next.
#[derive(Clone, Default)]
struct Channel {
    /// The position of its first lane.
    y: f64,
    lanes: usize,
}

impl Channel {
    /// The next free lane.
    fn next(&mut self) -> f64 {
        let y = self.y;
        self.y += LANE;
        y
    }
}

/// The points that an edge passes between its ends: along the lanes, and down the margin between two of them.
fn via((from, to): (&Rect, &Rect), lanes: &[f64], margin: f64) -> Vec<Point> {
    let (out, back) = (from.centre().x, to.centre().x);
    match *lanes {
        [lane] => vec![Point::new(out, lane), Point::new(back, lane)],
        [first, last] => vec![
            Point::new(out, first),
            Point::new(margin, first),
            Point::new(margin, last),
            Point::new(back, last),
        ],
        _ => Vec::new(),
    }
}

/// A layout with x along the edges and y across.
fn lying(layout: Layout, orientation: Orientation) -> Layout {
    if orientation == Orientation::LeftRight {
        return layout;
    }
    let rect = |r: &Rect| Rect::new(r.y, r.x, r.h, r.w);
    let route = |route: &Route| route.mapped(|p| Point::new(p.y, p.x));
    Layout {
        size: turned(layout.size, orientation),
        boxes: layout.boxes.iter().map(rect).collect(),
        clusters: layout.clusters.iter().map(rect).collect(),
        routes: layout.routes.iter().map(route).collect(),
        ..layout
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::layout::layered::lay_out;
    use crate::layout::tests::{cluster, link, vertex};

    /// A ring of `n` boxes, in a namespace or not.
    fn ring(n: usize, home: Option<usize>) -> Layout {
        let plan = Plan {
            vertices: vec![vertex(home); n],
            links: (0..n).map(|v| link(v, (v + 1) % n)).collect(),
            clusters: vec![cluster(None)],
            ..Plan::default()
        };
        let options = LayoutOptions {
            page: Size::new(1280.0, 560.0),
            ..LayoutOptions::default()
        };
        lay_out(&plan, &options)
    }

    #[test]
    fn a_long_ring_is_wrapped() {
        for home in [None, Some(0)] {
            let layout = ring(60, home);
            let aspect = layout.size.w / layout.size.h;
            assert!((1.0..4.0).contains(&aspect), "{home:?}: {:?}", layout.size);
            let routes = layout.routes.iter().flat_map(Route::points);
            assert!(routes.into_iter().all(|p| p.x >= 0.0 && p.y >= 0.0));
        }
    }

    #[test]
    fn a_short_chain_stays_a_line() {
        let size = ring(5, None).size;
        assert!(size.w > 3.0 * size.h || size.h > 3.0 * size.w, "{size:?}");
    }
}
