//! A page with one figure: with nodes, else with groups, else refused; and the notes below the drawing.

use std::collections::BTreeMap;

use super::{FigureOptions, MOST_HEIGHT, RowKind};
use crate::base::cast;
use crate::base::error::{Error, Result};
use crate::base::geometry::{Rect, Size};
use crate::base::words;
use crate::draw::scene::Scene;
use crate::draw::text::Fonts;
use crate::draw::timeline::arranged::{by_namespace, together};
use crate::draw::timeline::canvas::{PX_PER_MM, PaperCanvas, Sizes};
use crate::draw::timeline::drawer::{Density, Drawer};
use crate::draw::timeline::notes::flow;
use crate::draw::timeline::phases::names;
use crate::draw::timeline::rows::{self, Row};
use crate::draw::timeline::source::FigureSource;
use crate::draw::timeline::{Timeline, legend};

/// The shortest legible time axis, in millimetres: two of its labels side by side.
const SHORTEST_AXIS: f64 = 15.0;

/// The parts of a page.
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
            return Error::usage(
                format!("{width} mm leave no space for the time axis beside the names"),
                format!("use `--width {enough}mm`"),
            );
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
        Error::usage(
            format!("{rows} are {high:.0} mm high; a page has {MOST_HEIGHT} mm"),
            hint,
        )
    }
}

/// The filter that leaves as many tracks as fit: the largest namespace that is not too large.
pub(crate) fn filter_that_fits(tracks: &[Row], most: usize, flag: &str, word: &str) -> String {
    let mut spaces: BTreeMap<&str, usize> = BTreeMap::new();
    for top in tracks.iter().filter_map(|t| top_space(&t.name)) {
        *spaces.entry(top).or_default() += 1;
    }
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

/// The outermost namespace of a name, if it is in one.
fn top_space(name: &str) -> Option<&str> {
    let end = name.get(1..)?.find('/')?;
    name.get(..=end)
}

/// The error for a figure with nothing to draw: filters leave nothing, or no nodes are known.
pub(crate) fn nothing(source: &FigureSource<'_>) -> Error {
    if source.shown_topics().next().is_some() && source.knows_no_node() {
        return Error::usage(
            "no nodes were found",
            "draw its topics with `--kind lives`; `bagreel info` explains how to record more",
        );
    }
    Error::usage(
        "nothing is left to draw",
        "widen `--ns-filter` or `--topic-filter`; `bagreel info` lists all names",
    )
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
