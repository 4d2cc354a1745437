//! Space for badges and titles: the corner of a box, or the part of an arrow, where a badge covers least; the
//! position along the top of a frame where no line runs under its title.

use super::arrows::ArrowPath;
use super::boxes::{ItemBox, corners};
use crate::base::geometry::{Point, Rect, Size};

/// The most boxes and arrows for which space is searched: each position is compared with all of them, and in
/// a larger drawing a badge is smaller than a point.
const MOST: usize = 3000;

/// The distance of titles from the left of their frames, past its rounded corner, and from lines, in pixels of the graph.
const INSET: f64 = 8.0;
const CLEAR: f64 = 3.0;

/// The distance by which each title moves from the top left of its frame so that it covers no line, label, box or
/// border, and its position: along the top or, if the frame has no words there, along the bottom. A title without free
/// space does not move.
pub(super) fn place_titles(
    titles: &[(Rect, Size, bool)],
    cards: &[ItemBox],
    tracks: &[ArrowPath],
    scale: f64,
) -> Vec<(Point, Rect)> {
    let few = if tracks.len() > MOST { &[] } else { tracks };
    let lines: Vec<Vec<Point>> = few.iter().map(ArrowPath::points).collect();
    let pieces = lines.iter().flat_map(|line| line.windows(2));
    let pieces = pieces.filter_map(|ends| Rect::of_points(ends.iter().copied()));
    let borders = titles.iter().flat_map(|(frame, ..)| border(frame));
    let labels = few.iter().filter_map(ArrowPath::label_area);
    let boxes = cards.iter().map(|card| card.place);
    let mut taken: Vec<Rect> = pieces.chain(borders).chain(labels).chain(boxes).collect();
    taken.sort_by(|a, b| a.x.total_cmp(&b.x));
    let placed = titles.iter().map(|&(frame, size, has_footer)| {
        let (left, right) = (frame.x + INSET * scale, frame.right() - INSET * scale);
        let top = Rect::new(frame.x, frame.y, frame.w, size.h + CLEAR * scale);
        let bottom = top.moved(Point::new(0.0, frame.h - top.h - CLEAR * scale));
        let free = |strip: &Rect| {
            let before = taken.iter().take_while(|rect| rect.x < strip.right());
            let is_level = |rect: &&Rect| rect.y < strip.bottom() && rect.bottom() > strip.y;
            let mut x = left;
            for rect in before.filter(is_level) {
                if rect.x > x + size.w + CLEAR * scale {
                    break;
                }
                x = x.max(rect.right() + CLEAR * scale);
            }
            (x + size.w <= right).then_some(Point::new(x, strip.y))
        };
        let at =
            free(&top).or_else(|| Some(bottom).filter(|_| !has_footer).as_ref().and_then(free));
        let at = at.unwrap_or(Point::new(left, frame.y));
        let by = Point::new(at.x - left, at.y - frame.y);
        (by, Rect::new(at.x, at.y, size.w, size.h))
    });
    placed.collect()
}

/// The four lines of the border of a frame.
fn border(frame: &Rect) -> [Rect; 4] {
    let left = Rect::new(frame.x, frame.y, 0.0, frame.h);
    let top = Rect::new(frame.x, frame.y, frame.w, 0.0);
    let across = Point::new(frame.w, 0.0);
    let down = Point::new(0.0, frame.h);
    [left, top, left.moved(across), top.moved(down)]
}

/// Moves all badges of this radius to positions at which they cover no line, title or other box, if possible;
/// in very large drawings they do not move.
pub(super) fn place_badges(
    cards: &mut [ItemBox],
    tracks: &mut [ArrowPath],
    titles: Vec<Rect>,
    radius: f64,
    scale: f64,
) {
    for card in cards.iter_mut() {
        card.badge = corners(card.place, scale)[0];
    }
    if cards.len() + tracks.len() > MOST {
        return;
    }
    let mut room = Room::new(cards, tracks, radius);
    room.boxes.extend(titles);
    for (at, card) in cards.iter_mut().enumerate() {
        let free = corners(card.place, scale);
        card.badge = room.best(&free, (Some(at), None)).unwrap_or(card.badge);
    }
    for (at, track) in tracks.iter_mut().enumerate() {
        let best = room.best(&track.spots, (None, Some(at)));
        track.badge = best.unwrap_or(track.badge);
    }
}

/// All shapes that a badge may cover.
struct Room {
    /// Boxes, then labels.
    boxes: Vec<Rect>,
    /// Lines with the rectangles around them.
    lines: Vec<(Rect, Vec<Point>)>,
    radius: f64,
}

impl Room {
    fn new(cards: &[ItemBox], tracks: &[ArrowPath], radius: f64) -> Self {
        let line = |track: &ArrowPath| {
            let points = track.points();
            (around(&points), points)
        };
        let labels = tracks.iter().filter_map(ArrowPath::label_area);
        Self {
            boxes: cards.iter().map(|card| card.place).chain(labels).collect(),
            lines: tracks.iter().map(line).collect(),
            radius,
        }
    }

    /// The first of the positions at which a badge covers least, apart from its own box or line.
    fn best(&self, places: &[Point], own: (Option<usize>, Option<usize>)) -> Option<Point> {
        let covered = |place: &&Point| self.covered(**place, own);
        let free = places.iter().find(|place| covered(place) == 0);
        free.or_else(|| places.iter().min_by_key(covered)).copied()
    }

    fn covered(&self, at: Point, own: (Option<usize>, Option<usize>)) -> usize {
        let area = Rect::around(at, Size::new(2.0 * self.radius, 2.0 * self.radius));
        let boxes = self.boxes.iter().enumerate();
        let boxes = boxes.filter(|(k, place)| own.0 != Some(*k) && place.overlaps(&area));
        let lines = self.lines.iter().enumerate().filter(|(k, (around, line))| {
            own.1 != Some(*k) && around.overlaps(&area) && self.touches(at, line)
        });
        boxes.count() + lines.count()
    }

    fn touches(&self, at: Point, line: &[Point]) -> bool {
        line.windows(2)
            .any(|piece| apart(at, piece[0], piece[1]) < self.radius)
    }
}

/// The rectangle around points, at least a pixel wide and high.
fn around(points: &[Point]) -> Rect {
    let all = Rect::of_points(points.iter().copied());
    all.unwrap_or_default().grown(0.5)
}

/// The distance of a point from the line between two others.
fn apart(p: Point, a: Point, b: Point) -> f64 {
    let (dx, dy) = (b.x - a.x, b.y - a.y);
    let length = (dx * dx + dy * dy).max(1e-9);
    let part = (((p.x - a.x) * dx + (p.y - a.y) * dy) / length).clamp(0.0, 1.0);
    libm::hypot(a.x + part * dx - p.x, a.y + part * dy - p.y)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::draw::picture::GraphFit;
    use crate::draw::picture::texts::{Label, ShownRates};
    use crate::layout::Route;

    fn line(from: Point, to: Point) -> ArrowPath {
        let fit = GraphFit {
            scale: 1.0,
            pen: 1.0,
            origin: Point::default(),
        };
        let route = Route {
            start: from,
            curves: vec![[from, to, to]],
            label: None,
        };
        ArrowPath::new(String::new(), Default::default(), &route, None, fit)
    }

    fn card(place: Rect) -> ItemBox {
        ItemBox {
            id: String::new(),
            label: Label::default(),
            shown_rates: ShownRates::Nothing,
            card: None,
            place,
            badge: Point::default(),
        }
    }

    #[test]
    fn a_badge_avoids_a_corner_with_a_line() {
        let mut cards = [card(Rect::new(0.0, 0.0, 100.0, 40.0))];
        let along = |x: f64| line(Point::new(x, -50.0), Point::new(x, 90.0));
        place_badges(&mut cards, &mut [along(130.0)], Vec::new(), 8.0, 1.0);
        assert_eq!(cards[0].badge, Point::new(96.0, 1.0));
        place_badges(&mut cards, &mut [along(97.0)], Vec::new(), 8.0, 1.0);
        assert_eq!(cards[0].badge, Point::new(4.0, 1.0));
    }

    #[test]
    fn a_title_moves_along_its_frame_until_it_is_clear_of_lines() {
        let along = |x: f64| line(Point::new(x, -50.0), Point::new(x, 90.0));
        let title = |width: f64, lines: &[ArrowPath]| {
            let frame = Rect::new(0.0, 0.0, 200.0, 80.0);
            let titles = [(frame, Size::new(width, 14.0), false)];
            place_titles(&titles, &[], lines, 1.0)[0].0
        };
        assert!(title(50.0, &[along(70.0)]).x < 0.1);
        assert!((title(50.0, &[along(20.0), along(60.0)]).x - 55.0).abs() < 0.1);
        // There is no free space.
        assert_eq!(title(150.0, &[along(100.0)]), Point::default());
    }

    #[test]
    fn a_title_is_at_the_bottom_of_its_frame_if_lines_run_along_the_top() {
        let over = line(Point::new(-50.0, 8.0), Point::new(190.0, 8.0));
        let place = |has_footer: bool, place: Rect| {
            let titles = [(
                Rect::new(0.0, 0.0, 200.0, 80.0),
                Size::new(50.0, 14.0),
                has_footer,
            )];
            place_titles(&titles, &[card(place)], std::slice::from_ref(&over), 1.0)[0].0
        };
        let above = Rect::new(20.0, 20.0, 90.0, 30.0);
        assert_eq!(place(false, above), Point::new(0.0, 60.0));
        assert_eq!(place(true, above), Point::default());
        // Beside a box.
        assert_eq!(
            place(false, above.moved(Point::new(0.0, 20.0))),
            Point::new(105.0, 60.0)
        );
    }

    #[test]
    fn a_badge_on_an_arrow_avoids_crossings() {
        let mut both = [
            line(Point::new(0.0, 0.0), Point::new(200.0, 0.0)),
            line(Point::new(100.0, -30.0), Point::new(100.0, 90.0)),
        ];
        place_badges(&mut [], &mut both, Vec::new(), 8.0, 1.0);
        assert!((both[0].badge.x - 100.0).abs() > 8.0, "{:?}", both[0].badge);
    }
}
