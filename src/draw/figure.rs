//! Figures for papers, exact in width and never with text below 6 pt: lifelines, graph, holders and steps.
//!
//! A figure that does not fit with nodes is tried with groups; if that fails, the error suggests a filter.
//! Text is never scaled.

pub(crate) mod steps;
mod tex;

use super::scene::{Scene, Stroke};
use super::text::Fonts;
use super::timeline::canvas::{HAIRLINE, PX_PER_MM, PaperCanvas, Sizes, Type, ink};
use super::timeline::drawer::{Density, Drawer, clock};
use super::timeline::legend;
use super::timeline::notes::{flow, names, sentence};
use super::timeline::rows::{self, Row, by_namespace, together};
use super::timeline::{FigureSource, Timeline};
use crate::base::cast;
use crate::base::error::{Error, Result};
use crate::base::geometry::{Point, Rect, Size};
use crate::base::ids::tally;
use crate::base::name::ShortNames;
use crate::base::time::Span;
use crate::base::words::{self, worded};
use crate::graph::{Node, TopicId};
use crate::mission::rates::{Holder, Rates};
pub use tex::Latex;
pub(crate) use tex::caption;

worded! {
    /// The kind of figure.
    #[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
    pub enum FigureKind {
        /// Lifelines: when each row existed, how busy it was, and its changes.
        #[default]
        Lives = "lives",
        /// The graph of the whole mission, with the times of each node.
        Graph = "graph",
        /// Who sends each topic that changes hands or has several senders, and when nobody does.
        Holders = "holders",
        /// A panel per change of phase, with only what changes and its direct partners.
        Steps = "steps",
    }
}

worded! {
    /// The kind of element that the rows of lifelines represent.
    #[derive(Clone, Copy, Debug, PartialEq, Eq)]
    pub enum RowKind {
        /// Nodes, by role.
        Nodes = "nodes",
        /// Nodes that start and stop together.
        Groups = "groups",
        /// Topics.
        Topics = "topics",
    }
}

/// The options of a figure.
#[derive(Clone, Debug, PartialEq)]
pub struct FigureOptions {
    /// The kind of figure.
    pub kind: FigureKind,
    /// Its width in millimetres, exactly.
    pub width_mm: f64,
    /// The size of names in points, 7 to 12; all other text is 1 pt smaller.
    pub text_pt: f64,
    /// The kind of element that the rows of lifelines represent; `None` for the most detailed that fits.
    pub rows: Option<RowKind>,
    /// The boundaries that [`FigureKind::Steps`] shows, by the number of the phase that begins, ≥ 2; the largest if empty.
    pub steps: Vec<usize>,
    /// Whether legend and notes are left to the caption.
    pub is_bare: bool,
    /// Whether phases are the user's, so that their names are shown.
    pub is_named: bool,
}

impl Default for FigureOptions {
    fn default() -> Self {
        Self {
            kind: FigureKind::default(),
            width_mm: 88.0,
            text_pt: 7.0,
            rows: None,
            steps: Vec::new(),
            is_bare: false,
            is_named: false,
        }
    }
}

/// The largest height of a figure in millimetres: the text block of a page.
pub(crate) const MOST_HEIGHT: f64 = 225.0;

/// The shortest legible time axis, in millimetres: two of its labels side by side.
const SHORTEST_AXIS: f64 = 15.0;

/// The parts of a page with one figure.
pub(crate) struct FigureSheet<'a> {
    pub(crate) source: &'a FigureSource<'a>,
    pub(crate) fonts: &'a Fonts,
    pub(crate) sizes: Sizes,
    pub(crate) options: &'a FigureOptions,
}

impl<'a> FigureSheet<'a> {
    pub(crate) fn new(
        source: &'a FigureSource<'a>,
        fonts: &'a Fonts,
        options: &'a FigureOptions,
    ) -> Self {
        Self {
            source,
            fonts,
            sizes: Sizes::of_names(options.text_pt),
            options,
        }
    }

    pub(crate) fn canvas(&self) -> PaperCanvas<'a> {
        PaperCanvas::new(self.fonts, self.sizes, PX_PER_MM)
    }

    /// The title of the page: its kind and the bag's name.
    pub(crate) fn title(&self, what: &str) -> String {
        let bags = &self.source.mission.bags;
        match bags.first() {
            Some(bag) => format!("{what} of {}", words::visible(&bag.name)),
            None => what.to_owned(),
        }
    }

    /// The lifelines, and remarks for the user.
    ///
    /// # Errors
    /// [`Error::Usage`] if nothing is left, or if it does not fit even as groups.
    pub(crate) fn lives(&self) -> Result<(Scene, Vec<String>)> {
        let source = self.source;
        let kind = self.options.rows;
        let by_topics = match kind {
            Some(kind) => kind == RowKind::Topics,
            None => !source.knows_publishers(),
        };
        let rows = rows::of(source, by_topics);
        if rows.is_empty() {
            return Err(nothing(source));
        }
        let page = |rows| self.lives_page(&Timeline::new(source, rows)).filter(fits);
        let each = by_namespace(rows.clone(), source.span(), true);
        if kind != Some(RowKind::Groups)
            && let Some(scene) = page(each.clone())
        {
            return Ok((scene, Vec::new()));
        }
        if matches!(kind, None | Some(RowKind::Groups))
            && let Some(scene) = page(together(source, rows.clone(), self.most_rows(), true))
        {
            let remark =
                "not all rows fit on a page; elements that start and stop together are one row";
            let remarks = kind.is_none().then(|| remark.to_owned());
            return Ok((scene, remarks.into_iter().collect()));
        }
        Err(self.too_high(&Timeline::new(source, each), &rows, by_topics))
    }

    /// The page of some rows, of any height; `None` if it is too narrow.
    fn lives_page(&self, timeline: &Timeline) -> Option<Scene> {
        let (mut canvas, width) = (self.canvas(), self.options.width_mm);
        let drawer = lives_drawer(timeline, &canvas, width)?;
        let mut y = drawer.ground(&mut canvas);
        drawer.marks(&mut canvas);
        canvas.begin("words");
        if self.options.is_named || !self.options.is_bare {
            y = names(&mut canvas, self.source, width, y);
        }
        y = flow(&mut canvas, width, y, &legend::letters(timeline));
        if !self.options.is_bare {
            let notes = legend::notes(timeline, drawer.beside.is_some());
            y = flow(&mut canvas, width, y, &notes);
            y = flow(&mut canvas, width, y + 0.15, &legend::signs(timeline));
        }
        Some(canvas.into_scene(Size::new(width, y + 0.3), self.title("Lifelines")))
    }

    /// The number of rows that fit on a page with their notes.
    pub(crate) fn most_rows(&self) -> usize {
        cast::to_usize((MOST_HEIGHT - 30.0) / self.sizes.pitch())
    }

    /// The error for a figure that does not fit, with a namespace that would fit.
    fn too_high(&self, timeline: &Timeline, rows: &[Row], by_topics: bool) -> Error {
        let (canvas, width) = (self.canvas(), self.options.width_mm);
        if lives_drawer(timeline, &canvas, width).is_none() {
            let mut wider = (0..100).map(|mm| libm::ceil(width) + f64::from(mm));
            let enough = wider.find(|w| lives_drawer(timeline, &canvas, *w).is_some());
            let enough = enough.unwrap_or(88.0);
            let what = format!("{width} mm leave no space for the time axis beside the names");
            return Error::usage(what, format!("use `--width {enough}mm`"));
        }
        let flag = if by_topics {
            "--topic-filter"
        } else {
            "--ns-filter"
        };
        self.too_many(timeline, rows, (flag, "row"))
    }

    /// The error for too many of these rows, with a filter that leaves as many as fit.
    pub(crate) fn too_many(
        &self,
        timeline: &Timeline,
        rows: &[Row],
        (flag, word): (&str, &str),
    ) -> Error {
        let high = timeline.height(self.sizes, self.sizes.pitch());
        let hint = filter_that_fits(rows, self.most_rows(), flag, word);
        let rows = words::count(timeline.rows.len(), word);
        let what = format!("{rows} are {high:.0} mm high; a page has {MOST_HEIGHT} mm");
        Error::usage(what, hint)
    }
}

/// The filter that leaves as many tracks as fit: the largest namespace that is not too large.
fn filter_that_fits(tracks: &[Row], most: usize, flag: &str, word: &str) -> String {
    // The outermost namespace of each name that is in one.
    let tops = tracks.iter().filter_map(|row| {
        let end = row.name.get(1..)?.find('/')? + 1;
        Some(&row.name[..end])
    });
    let spaces = tally(tops);
    let fitting = spaces.iter().filter(|(_, many)| **many <= most);
    let best = fitting.max_by_key(|(name, many)| (**many, std::cmp::Reverse(**name)));
    let most = words::count(most, word);
    match best {
        None => format!("at most {most} fit; select some with `{flag}`"),
        Some((name, many)) => {
            format!("`{flag} '{name}/.*'` leaves {many}; at most {most} fit")
        }
    }
}

/// The error for a figure with nothing to draw: filters leave nothing, or no nodes are known.
pub(crate) fn nothing(source: &FigureSource<'_>) -> Error {
    // Whatever the filters say.
    let is_without_nodes = source.mission.elements.nodes.iter().all(Node::is_tool);
    if source.shown_topics().next().is_some() && is_without_nodes {
        let hint =
            "draw its topics with `--kind lives`; `bagreel info` explains how to record more";
        return Error::usage("no nodes were found", hint);
    }
    let hint = "widen `--ns-filter` or `--topic-filter`; `bagreel info` lists all names";
    Error::usage("nothing is left to draw", hint)
}

pub(crate) fn fits(scene: &Scene) -> bool {
    scene.size.h <= MOST_HEIGHT * PX_PER_MM
}

/// A page of rows over time; `None` if too little is left for the time axis.
fn lives_drawer(timeline: &Timeline, canvas: &PaperCanvas<'_>, width: f64) -> Option<Drawer> {
    let drawer = drawer(timeline.clone(), canvas, width);
    let axis = drawer.axis.right - drawer.axis.left;
    (axis >= SHORTEST_AXIS).then_some(drawer)
}

/// A page of rows over time, below the heads of columns if there is no band of phases.
pub(crate) fn drawer(timeline: Timeline, canvas: &PaperCanvas<'_>, width: f64) -> Drawer {
    let has_band = !timeline.phases.is_empty();
    let top = if has_band { 0.0 } else { canvas.sizes.line() };
    let place = Rect::new(0.0, top, width, 0.0);
    Drawer::new(timeline, Density::Paper, canvas, place)
}

/// The space between the graph and the band in millimetres, half a line of text.
const BELOW: f64 = 1.2;

/// The page of the graph: a picture of the mission in one window, as wide as the page, above the band of phases.
pub(crate) fn graph(sheet: &FigureSheet<'_>, picture: Scene) -> Scene {
    let (source, width) = (sheet.source, sheet.options.width_mm);
    let mut canvas = sheet.canvas();
    let mut y = picture.size.h / PX_PER_MM;
    if !source.phases.is_empty() {
        let timeline = Timeline::new(source, Vec::new());
        let place = Rect::new(0.0, y + BELOW, width, 0.0);
        let drawer = Drawer::new(timeline, Density::Paper, &canvas, place);
        let drawer = drawer.without_columns(width);
        y = drawer.ground(&mut canvas);
        canvas.begin("words");
        y = names(&mut canvas, source, width, y);
    }
    canvas.begin("notes");
    if !sheet.options.is_bare {
        let text = "Bar in a box: when the node ran, from the start of the mission to its end; ticks: starts, ends and \
                    restarts. Line: topics with their rates, dashed if inferred.";
        y = flow(&mut canvas, width, y + 0.4, &[sentence(ink::QUIET, text)]);
    }
    let mut scene = canvas.into_scene(Size::new(width, y + 0.3), sheet.title("Graph"));
    scene.groups.splice(..0, picture.groups);
    scene
}

/// The height of a bar as a share of its lane: neighbours in time and in lanes are apart.
const BAR: f64 = 0.84;
/// The space around a name in millimetres.
const AROUND: f64 = 0.5;

/// The topics with several senders, in order of their names, each with its lanes.
fn lanes<'a>(source: &FigureSource<'a>) -> Vec<(TopicId, Vec<Vec<Holder<'a>>>)> {
    let rates = Rates::new(source.mission);
    let of = |topic: TopicId| {
        let holders = rates.holders(topic);
        let mut lanes: Vec<Vec<Holder>> = Vec::new();
        let many = holders.len();
        for holder in holders {
            let is_free = |lane: &&mut Vec<Holder>| {
                lane.last().is_some_and(|last| last.end() <= holder.start())
            };
            match lanes.iter_mut().find(is_free) {
                Some(lane) => lane.push(holder),
                None => lanes.push(vec![holder]),
            }
        }
        (many > 1).then_some((topic, lanes))
    };
    let topics = source.shown_topics().filter(|topic| !source.is_hub(*topic));
    topics.filter_map(of).collect()
}

/// The page of holders: who sends each topic that changes hands or has several senders, and when nobody does; a lane of bars
/// per topic, and one more for each sender at the same time.
///
/// # Errors
/// [`Error::Usage`] if no topic has several senders, or if they do not fit; the hint suggests what would.
pub(crate) fn holders(sheet: &FigureSheet<'_>) -> Result<Scene> {
    let (source, width) = (sheet.source, sheet.options.width_mm);
    let topics = lanes(source);
    if topics.is_empty() {
        if source.roles.is_empty() {
            return Err(nothing(source));
        }
        let hint = "draw `--kind lives`, which shows when each node sends";
        return Err(Error::usage("no topic has several known senders", hint));
    }
    let row = |topic: TopicId, at: usize| Row {
        name: source.topic(topic).into(),
        labels: vec![if at == 0 { source.topic(topic) } else { "" }.to_owned()],
        ..Row::default()
    };
    let rows = topics
        .iter()
        .flat_map(|(topic, lanes)| (0..lanes.len()).map(|at| row(*topic, at)));
    let rows: Vec<Row> = rows.collect();
    let mut canvas = sheet.canvas();
    let timeline = Timeline::new(source, rows);
    if timeline.rows.len() > sheet.most_rows() {
        return Err(sheet.too_many(&timeline, &timeline.rows, ("--topic-filter", "lane")));
    }
    let drawer = drawer(timeline, &canvas, width).without_columns(width);
    let end = drawer.ground(&mut canvas);
    let mut first = 0;
    for (topic, lanes) in &topics {
        let all = lanes.iter().flatten().flat_map(|holder| &holder.times);
        canvas.begin("nobody");
        let (top, bottom) = (drawer.y(first), drawer.y(first + lanes.len() - 1));
        for gap in gaps(source.span(), Span::joined(all.copied().collect(), 0)) {
            let lane = drawer.pitch * BAR;
            canvas.hatch(drawer.axis.rect(gap, top - lane / 2.0, bottom - top + lane));
        }
        if first > 0 {
            let y = top - drawer.pitch / 2.0;
            let rule = Stroke::solid(ink::RULE, HAIRLINE);
            canvas.line(Point::new(0.0, y), Point::new(width, y), &rule);
        }
        let roles = lanes.iter().flatten().map(|holder| holder.role);
        let short: ShortNames = roles.collect();
        for (at, holders) in lanes.iter().enumerate() {
            let lane = Lane {
                drawer: &drawer,
                y: drawer.y(first + at),
                topic: source.topic(*topic),
            };
            lane.draw(&mut canvas, holders, &short);
        }
        first += lanes.len();
    }
    canvas.begin("words");
    let mut y = names(&mut canvas, source, width, end);
    if !sheet.options.is_bare {
        let text = "Bar: the node that sends the topic; bars above each other: several at once; hatched: nobody.";
        y = flow(&mut canvas, width, y + 0.15, &[sentence(ink::QUIET, text)]);
    }
    Ok(canvas.into_scene(Size::new(width, y + 0.3), sheet.title("Senders")))
}

/// A lane at its place.
struct Lane<'a> {
    drawer: &'a Drawer,
    y: f64,
    topic: &'a str,
}

impl Lane<'_> {
    /// Draws the bars of holders one after the other, each with its name once: in its longest bar, else where there is
    /// room behind or before it.
    fn draw(&self, canvas: &mut PaperCanvas<'_>, holders: &[Holder<'_>], names: &ShortNames<'_>) {
        let axis = &self.drawer.axis;
        let high = self.drawer.pitch * BAR;
        let bar = |time: &Span| axis.rect(*time, self.y - high / 2.0, high);
        let start = axis.span.start;
        for (k, holder) in holders.iter().enumerate() {
            let name = names.of(holder.role);
            let times = holder.times.iter().map(|time| {
                let [from, to] = [time.start, time.end].map(|at| clock(at.since(start)));
                format!("{from} to {to}")
            });
            let times = times.collect::<Vec<_>>().join(", ");
            let title = format!("{} sends {} from {times}", holder.role, self.topic);
            canvas.begin_mark("holder", &[], words::visible(&title).into_owned());
            for time in &holder.times {
                canvas.fill(bar(time), ink::LINE);
            }
            let Some(longest) = holder.times.iter().max_by_key(|time| time.nanos()) else {
                continue;
            };
            let (place, wide) = (bar(longest), canvas.width(name, Type::Small) + 2.0 * AROUND);
            let before = k.checked_sub(1).map(|before| axis.x(holders[before].end()));
            let next = holders.get(k + 1).map(|next| axis.x(next.start()));
            let own = [axis.x(holder.start()), axis.x(holder.end())];
            if wide <= place.w {
                self.name(canvas, place.centre().x - wide / 2.0, true, name);
            } else if own[1] + wide <= next.unwrap_or(axis.right) {
                self.name(canvas, own[1], false, name);
            } else if own[0] - wide >= before.unwrap_or(axis.left) {
                self.name(canvas, own[0] - wide, false, name);
            } else {
                let cut = canvas.cut(name, Type::Small, place.w - 2.0 * AROUND);
                self.name(canvas, place.x, true, &cut);
            }
        }
    }

    /// Writes a name from `x` on, inside a bar or beside it.
    fn name(&self, canvas: &mut PaperCanvas<'_>, x: f64, is_inside: bool, name: &str) {
        let color = if is_inside { ink::PAPER } else { ink::TEXT };
        if !is_inside {
            // The hatching ends around words.
            let wide = canvas.width(name, Type::Small) + AROUND;
            let high = canvas.sizes.line();
            let ground = Rect::new(x + AROUND / 2.0, self.y - high / 2.0, wide, high);
            canvas.fill(ground, ink::PAPER);
        }
        canvas.text(x + AROUND, self.y, Type::Small, color, name);
    }
}

/// The parts of `whole` outside of these times, which are sorted and do not overlap.
fn gaps(whole: Span, times: Vec<Span>) -> Vec<Span> {
    let mut gaps = Vec::new();
    let mut from = whole.start;
    for time in times {
        if time.start > from {
            gaps.push(Span::new(from, time.start));
        }
        from = from.max(time.end);
    }
    if from < whole.end {
        gaps.push(Span::new(from, whole.end));
    }
    gaps
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::base::time::Stamp;

    #[test]
    fn nobody_holds_a_topic_between_its_senders() {
        let span = |from, to| Span::new(Stamp(from), Stamp(to));
        assert_eq!(gaps(span(0, 9), vec![]), [span(0, 9)]);
        assert_eq!(
            gaps(span(0, 9), vec![span(1, 3), span(5, 9)]),
            [span(0, 1), span(3, 5)]
        );
        assert_eq!(gaps(span(0, 9), vec![span(0, 8)]), [span(8, 9)]);
        assert_eq!(gaps(span(0, 9), vec![span(0, 9)]), []);
    }
}
