//! A page with one figure: with nodes, else with groups, else refused; and the notes below the drawing.

use super::groups::depths;
use super::{FigureOptions, MOST_HEIGHT, RowKind};
use crate::base::cast;
use crate::base::error::{Error, Result};
use crate::base::geometry::Size;
use crate::base::name::last_part;
use crate::base::words;
use crate::draw::scene::Scene;
use crate::draw::text::Fonts;
use crate::draw::timeline::band::{Axis, clock, names};
use crate::draw::timeline::canvas::{PX_PER_MM, PaperCanvas, Sizes, Type, ink};
use crate::draw::timeline::legend;
use crate::draw::timeline::lives::{LivesFigure, RowPlace, WIDE};
use crate::draw::timeline::notes::{TextRun, Unbroken, flow, sentence};
use crate::draw::timeline::rows::FigureRow;
use crate::draw::timeline::signs::sign;
use crate::draw::timeline::source::FigureSource;
use crate::draw::timeline::tracks::Track;

/// The shortest legible time axis, in millimetres.
const SHORTEST_AXIS: f64 = 15.0;

/// The most names of one kind that are reported in a note; the others are counted.
pub(crate) const MOST_NAMED: usize = 60;

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
        let by_topics = match self.options.rows {
            Some(rows) => rows == RowKind::Topics,
            None => !self.source.knows_publishers(),
        };
        let first = LivesFigure::new(self.source, by_topics);
        if first.rows.is_empty() {
            return Err(nothing(self.source));
        }
        let is_grouped = self.options.rows == Some(RowKind::Groups);
        let (mut scene, mut remarks) = (None, Vec::new());
        if !is_grouped {
            scene = self.lives_page(&first).filter(fits);
        }
        if scene.is_none()
            && !by_topics
            && matches!(self.options.rows, None | Some(RowKind::Groups))
        {
            scene = depths(&first.tracks).find_map(|depth| {
                let tracks = super::groups::tracks(self.source, &first.tracks, depth);
                let groups = LivesFigure::of(self.source, tracks);
                self.lives_page(&groups).filter(fits)
            });
            if scene.is_some() && !is_grouped {
                let many = words::count(first.tracks.len(), "node");
                remarks.push(format!(
                    "{many} do not fit on a page; rows are groups of nodes that start and stop together"
                ));
            }
        }
        let scene = scene.ok_or_else(|| self.too_high(&first))?;
        Ok((scene, remarks))
    }

    /// The page of some lifelines, of any height; `None` if it is too narrow.
    fn lives_page(&self, lives: &LivesFigure<'_>) -> Option<Scene> {
        let width = self.options.width_mm;
        let mut canvas = self.canvas();
        let place = lives_place(lives, &canvas, width)?;
        let mut y = lives.draw(&mut canvas, &place);
        canvas.begin("words");
        if self.options.is_named || !self.options.is_bare {
            y = names(&mut canvas, self.source, width, y, None);
        }
        y = flow(&mut canvas, width, y, &letter_items(lives));
        if !self.options.is_bare {
            let notes = lives_notes(lives, place.talk.is_some());
            y = flow(&mut canvas, width, y, &notes);
            y = flow(&mut canvas, width, y + 0.15, &legend::items(lives));
        }
        let what = if lives.is_of_topics() {
            "Lifelines of topics"
        } else {
            "Lifelines"
        };
        Some(canvas.into_scene(Size::new(width, y + 0.3), self.title(what)))
    }

    /// The error for a figure that does not fit, with a namespace that would fit.
    fn too_high(&self, lives: &LivesFigure<'_>) -> Error {
        let canvas = self.canvas();
        let width = self.options.width_mm;
        if lives_place(lives, &canvas, width).is_none() {
            let wider = (0..100).map(|mm| libm::ceil(width) + f64::from(mm));
            let enough = wider.filter(|w| lives_place(lives, &canvas, *w).is_some());
            let enough = enough.take(1).next().unwrap_or(88.0);
            return Error::usage(
                format!("{width} mm leave no space for the time axis beside the names"),
                format!("use `--width {enough}mm`"),
            );
        }
        let high = lives.height(&canvas);
        let most = cast::to_usize((MOST_HEIGHT - 30.0) / self.sizes.pitch());
        let flag = if lives.is_of_topics() {
            "--topic-filter"
        } else {
            "--ns-filter"
        };
        let hint = filter_that_fits(&lives.tracks, most, flag, "row");
        let rows = words::count(lives.rows.len(), "row");
        Error::usage(
            format!("{rows} are {high:.0} mm high; a page has {MOST_HEIGHT} mm"),
            hint,
        )
    }
}

/// The filter that leaves as many tracks as fit: the largest namespace that is not too large.
pub(crate) fn filter_that_fits(tracks: &[Track], most: usize, flag: &str, word: &str) -> String {
    let mut spaces: Vec<(&str, usize)> = Vec::new();
    for top in tracks.iter().filter_map(|t| top_space(&t.name)) {
        match spaces.iter_mut().find(|(name, _)| *name == top) {
            Some((_, many)) => *many += 1,
            None => spaces.push((top, 1)),
        }
    }
    let fitting = spaces.iter().filter(|(_, many)| *many <= most);
    let best = fitting.max_by_key(|(name, many)| (*many, std::cmp::Reverse(*name)));
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

/// The columns of a page of lifelines; `None` if too little is left for the time axis.
fn lives_place(lives: &LivesFigure<'_>, canvas: &PaperCanvas<'_>, width: f64) -> Option<RowPlace> {
    let names = lives.names_width(canvas, width.min(WIDE.0));
    let talk = if width >= WIDE.0 { WIDE.1 + 1.8 } else { 0.0 };
    let right = width - talk - 5.2;
    let left = names.max(canvas.width("min:s", Type::Small) + 1.5);
    let top = if lives.source.phases.is_empty() {
        canvas.sizes.line()
    } else {
        0.0
    };
    (right - left >= SHORTEST_AXIS).then_some(RowPlace {
        top,
        left: 0.0,
        axis: Axis {
            left,
            right,
            span: lives.source.span(),
        },
        rates: Some(right + 5.1),
        talk: (width >= WIDE.0).then_some((width - WIDE.1, WIDE.1)),
        is_live: false,
    })
}

/// The letters explained, in order of time.
fn letter_items(lives: &LivesFigure<'_>) -> Vec<Unbroken> {
    let start = lives.source.span().start;
    let item = |(k, letter): (usize, &crate::draw::timeline::marks::Letter)| {
        let at = clock(letter.mark.at.since(start));
        vec![
            TextRun::Words(Type::Strong, ink::CHANGED, format!("{} ", sign(k))),
            TextRun::Words(Type::Small, ink::TEXT, format!("{at} {}", letter.text)),
        ]
    };
    lives.marks.letters.iter().enumerate().map(item).collect()
}

/// The notes below the legend: the members of collapsed rows if no column lists them, and the number of
/// events without a letter.
fn lives_notes(lives: &LivesFigure<'_>, is_reported: bool) -> Vec<Unbroken> {
    let mut items = Vec::new();
    for row in lives.rows.iter().filter(|_| !is_reported) {
        if let FigureRow::Folded(all, space) = row {
            let names: Vec<&str> = all
                .iter()
                .map(|at| last_part(&lives.tracks[*at].name))
                .collect();
            let text = format!(
                "Throughout in {space}: {}.",
                words::some_of(&names, MOST_NAMED)
            );
            items.push(sentence(ink::QUIET, text));
        }
    }
    if lives.marks.unlettered > 0 {
        let text = format!(
            "{} without a letter.",
            words::count(lives.marks.unlettered, "smaller change")
        );
        items.push(sentence(ink::QUIET, text));
    }
    items
}
