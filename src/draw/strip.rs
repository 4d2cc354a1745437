//! The film strip: chosen windows side by side on one page, with one legend and the time under each.

use super::picture::{Measured, PageOptions, Picture};
use super::scene::{Anchor, Font, Form, Group, Scene, Shape, Stroke, Text};
use super::style::Style;
use super::text::{Fonts, Weight};
use super::timeline::canvas::PX_PER_MM;
use crate::base::error::{Error, Result};
use crate::base::geometry::{Point, Rect, Size};
use crate::base::{time, words};
use crate::layout::Layout;
use crate::mission::Mission;
use crate::view::{Counts, View, Words, joined};

/// The smallest legible text on paper, in points.
const SMALLEST_PT: f64 = 6.0;
/// Points per pixel, 96 pixels to the inch.
const PT_PER_PX: f64 = 0.75;
/// The smallest legible text on a screen, in pixels.
const SMALLEST_PX: f64 = 9.0;
/// The font size of times and captions in pixels: on paper (6.75 pt) and on a screen.
const CAPTION: (f64, f64) = (9.0, 14.0);
/// Space between panels, in pixels.
const GAP: f64 = 10.0;
/// The factor by which small graphs are enlarged, and the narrowest panel, for the words below it.
const ENLARGED: f64 = 1.2;
const NARROWEST: f64 = 480.0;
/// Shapes of panels that are tried on paper: height over width.
pub(crate) const SHAPES: [f64; 4] = [0.4, 0.6, 1.0, 1.6];
/// The largest height of a strip over its width, if there is a choice: a page of A4, 1.4 times as high as
/// wide, has room for its caption.
const HIGHEST: f64 = 1.3;

/// A strip and remarks for the user.
#[derive(Clone, Debug, PartialEq)]
pub struct Strip {
    /// The page.
    pub scene: Scene,
    /// Remarks on how to make it more readable; lower case, no period.
    pub remarks: Vec<String>,
}

/// The source of a strip.
#[derive(Clone, Copy)]
pub struct StripSource<'a> {
    /// The mission, for its start.
    pub mission: &'a Mission,
    /// The view of the mission.
    pub view: &'a View,
    /// The picture of the view, with all positions.
    pub picture: &'a Picture<'a>,
    /// The style of the picture.
    pub style: &'a Style,
    /// The fonts for all text.
    pub fonts: &'a Fonts,
    /// Other layouts of the graph, of which one may be more legible.
    pub others: &'a [Layout],
}

/// The width of a strip.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum StripWidth {
    /// Exactly this many millimetres on paper.
    Paper(f64),
    /// At least this many pixels on a screen, and as many as legible text needs.
    AtLeast(f64),
    /// The same, but less if the graphs are small.
    About(f64),
}

/// The strip of `choice`.
///
/// # Errors
/// [`Error::Usage`] for a window that does not exist, and for more than 200,000 boxes and arrows on all panels together.
pub fn strip(source: StripSource<'_>, choice: &Choice, width: StripWidth) -> Result<Strip> {
    let width_mm = match width {
        StripWidth::Paper(mm) => Some(mm),
        StripWidth::AtLeast(_) | StripWidth::About(_) => None,
    };
    let windows = choice.places(source.view)?;
    let mut best: Option<(f64, PanelGrid, Picture<'_>)> = None;
    for layout in std::iter::once(source.picture.layout()).chain(source.others) {
        let bare = source.bare(layout);
        let page = PanelGrid::new(choice, windows.len(), &bare, width);
        // A page that is too high is rated as if it were shrunk to fit.
        let high = page.corner(windows.len().next_multiple_of(page.columns)).y;
        let text = page.text / (high / page.width / HIGHEST).max(1.0);
        if best.as_ref().is_none_or(|(most, ..)| text > *most) {
            best = Some((text, page, bare));
        }
    }
    let Some((_, page, bare)) = best else {
        return Err(Error::usage("there is nothing to show", ""));
    };
    let mut groups = Vec::new();
    for (at, window) in windows.iter().enumerate() {
        source.panel(&bare.scene(*window), &page, at, *window, &mut groups);
        if groups.len() > MOST_GROUPS {
            return Err(Error::usage(
                format!("a strip of more than {MOST_GROUPS} boxes and arrows is too large"),
                "choose fewer windows (`--strip 2x1`) or elements (`--ns-filter`, `--collapse`)",
            ));
        }
    }
    let rows = windows.len().div_ceil(page.columns);
    let graphs = page.corner(rows * page.columns).y;
    let height = graphs + source.legend(&page, graphs, &mut groups);
    let remarks = width_mm.map(|mm| remark(page.text, mm)).into_iter();
    let scene = Scene {
        size: Size::new(page.width, height),
        width_mm,
        background: source.style.background(),
        title: format!("{} of {} windows", windows.len(), source.view.frames.len()),
        groups,
    };
    Ok(Strip {
        scene,
        remarks: remarks.flatten().collect(),
    })
}

/// The remark about a smallest text of `text_px` pixels on paper; `None` if it is legible.
fn remark(text_px: f64, mm: f64) -> Option<String> {
    let points = text_px * PT_PER_PX;
    (points < SMALLEST_PT).then(|| {
        let wide = libm::ceil(mm * SMALLEST_PT / points);
        format!(
            "the smallest text on the strip is {points:.1} pt; `--width {wide}mm`, fewer columns, or fewer elements \
             (`--ns-filter`, `--collapse`) would enlarge it to {SMALLEST_PT} pt"
        )
    })
}

/// The number of panels side by side: as given, else the fewest with which the page is not too high.
fn columns(choice: &Choice, panels: usize, natural: Size) -> usize {
    if let Choice::Grid(columns, _) = choice {
        return (*columns).min(panels).max(1);
    }
    let high = |columns: usize| {
        let rows = panels.div_ceil(columns) as f64;
        rows * natural.h / natural.w.max(1.0) / columns as f64
    };
    (1..=panels).find(|c| high(*c) <= HIGHEST).unwrap_or(1)
}

/// The most boxes, arrows and names of all panels together: with two kilobytes each, half a gigabyte, and a hundred
/// times as many as can be told apart.
const MOST_GROUPS: usize = 200_000;

/// The largest area of panels in square pixels that a strip on a screen may take for legible text: 96 MB of pixels.
const LARGEST_STRIP: f64 = 24e6;

/// The grid of panels.
struct PanelGrid {
    columns: usize,
    width: f64,
    /// The size of a panel.
    panel: Size,
    /// The scale of the graph in its middle.
    scale: f64,
    /// The font size of text outside the graphs.
    caption: f64,
    /// The smallest font size in the graphs.
    text: f64,
}

impl PanelGrid {
    fn new(choice: &Choice, panels: usize, bare: &Picture<'_>, width: StripWidth) -> Self {
        let natural = bare.scene(0).size;
        let columns = columns(choice, panels, natural);
        let all = |panel: f64| (panel + GAP) * columns as f64 + GAP;
        let on_screen = |least: f64| {
            let legible = natural.w * SMALLEST_PX / bare.text_px().max(0.1);
            let rows = panels.div_ceil(columns) as f64;
            let square = natural.h / natural.w.max(1.0) / columns as f64 * rows;
            let widest = (LARGEST_STRIP / square.max(0.01)).sqrt();
            least.max(all(legible).min(widest))
        };
        let (page, caption) = match width {
            StripWidth::Paper(mm) => (mm * PX_PER_MM, CAPTION.0),
            StripWidth::AtLeast(width) => (on_screen(width), CAPTION.1),
            StripWidth::About(width) => {
                let most = all((natural.w * ENLARGED).max(NARROWEST));
                (on_screen(width.min(most)), CAPTION.1)
            }
        };
        let wide = ((page - GAP * (columns as f64 + 1.0)) / columns as f64).max(1.0);
        let scale = wide / natural.w.max(1.0);
        let scale = match width {
            StripWidth::About(_) => scale.min(ENLARGED),
            StripWidth::Paper(_) | StripWidth::AtLeast(_) => scale,
        };
        Self {
            columns,
            width: page,
            panel: Size::new(wide, natural.h * scale),
            scale,
            caption,
            text: bare.text_px() * scale,
        }
    }

    /// The top left corner of a panel.
    fn corner(&self, at: usize) -> Point {
        let (row, column) = (at / self.columns, at % self.columns);
        let high = self.panel.h + 2.0 * 1.3 * self.caption + GAP;
        let x = GAP + column as f64 * (self.panel.w + GAP);
        Point::new(x, GAP + row as f64 * high)
    }
}

impl<'a> StripSource<'a> {
    /// The picture without title, legend and timeline, at its natural size.
    fn bare(&self, layout: &Layout) -> Picture<'a> {
        let options = PageOptions {
            size: Size::new(layout.size.w * 1.06 + 8.0, layout.size.h * 1.06 + 8.0),
            bare: true,
            ..PageOptions::default()
        };
        Measured::new(self.view, self.style, self.fonts, options).with(layout.clone())
    }

    /// Draws one window with its frame, its time and its changes.
    fn panel(
        &self,
        scene: &Scene,
        page: &PanelGrid,
        at: usize,
        window: usize,
        groups: &mut Vec<Group>,
    ) {
        let corner = page.corner(at);
        let frame = &self.view.frames[window];
        let mut panel = Group::named(&format!("panel-{}", frame.index));
        "panel".clone_into(&mut panel.class);
        let border = Rect::new(corner.x, corner.y, page.panel.w, page.panel.h);
        let line = Stroke::solid(self.style.legend.line, 0.5);
        panel.shape(Shape::line(Form::Rect(border, 0.0), line));
        let start = self.mission.span.start;
        let time = |at: time::Stamp| words::moment_rounded(at.since(start));
        let mut times = format!("{}–{}", time(frame.span.start), time(frame.span.end));
        if let Some(phase) = self.picture.phase(window) {
            times = format!("{times} {phase}");
        }
        let wide = |text: &str| self.fonts.width(text, page.caption, Weight::Regular);
        let fits = |words: &[Words]| wide(&joined(words)) <= page.panel.w;
        let lines = [
            (times, Weight::SemiBold),
            (joined(&frame.fitting(fits)), Weight::Regular),
        ];
        for (row, (words, weight)) in (1_u8..).zip(lines) {
            let (size, words) = (page.caption, self.fonts.shown(&words));
            let at = Point::new(corner.x, border.bottom() + f64::from(row) * 1.3 * size);
            let font = Font::new(size, weight, self.style.legend.text);
            let words = self.fonts.fit(&words, size, weight, page.panel.w);
            panel.text(Text::new(Anchor::Start, at, font, words));
        }
        groups.push(panel);
        let aside = (page.panel.w - scene.size.w * page.scale).max(0.0) / 2.0;
        let corner = Point::new(corner.x + aside, corner.y);
        for group in &scene.groups {
            let mut group = group.placed(page.scale, corner);
            group.id = format!("w{}-{}", frame.index, group.id);
            groups.push(group);
        }
    }

    /// Draws the shared legend from `y` on; returns its height.
    fn legend(&self, page: &PanelGrid, y: f64, groups: &mut Vec<Group>) -> f64 {
        let options = PageOptions {
            size: Size::new(page.width, 300.0),
            unit: Some(page.caption / self.style.legend.size),
            ..PageOptions::default()
        };
        let measured = Measured::new(self.view, self.style, self.fonts, options);
        let (legend, place) = measured.legend();
        groups.push(legend.placed(1.0, Point::new(0.0, y - place.y)));
        place.h + GAP
    }
}

/// The windows of a strip.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Choice {
    /// Columns and rows: the first window and those that change most.
    Grid(usize, usize),
    /// The first window and all that show a change, at most a dozen.
    Changes,
    /// These windows, by index.
    Windows(Vec<usize>),
}

/// The most windows on a strip that are chosen for the user: of three columns, four rows.
const MOST: usize = 12;
impl Choice {
    /// Reads `3x2`, `changes` or `0,4,9`.
    ///
    /// # Errors
    /// [`Error::Usage`] for anything else.
    pub fn parse(text: &str) -> Result<Self> {
        let number = |t: &str| t.trim().parse::<usize>().ok();
        let grid = text.split_once('x').and_then(|(columns, rows)| {
            let (columns, rows) = (number(columns)?, number(rows)?);
            let sound = (1..=100).contains(&columns) && (1..=100).contains(&rows);
            sound.then_some(Self::Grid(columns, rows))
        });
        let windows: Option<Vec<usize>> = text.split(',').map(number).collect();
        match (text, grid, windows) {
            ("changes", ..) => Ok(Self::Changes),
            (_, Some(grid), _) => Ok(grid),
            (_, _, Some(windows)) => Ok(Self::Windows(windows)),
            _ => {
                let what = format!("`{text}` is not a choice of windows");
                let hint =
                    "give `--strip` columns and rows (`3x2`), `changes`, or windows (`0,4,9`)";
                Err(Error::usage(what, hint))
            }
        }
    }

    /// The chosen windows as indices in `view`, in order; at least one if there is any.
    ///
    /// # Errors
    /// [`Error::Usage`] for a window that does not exist.
    pub fn places(&self, view: &View) -> Result<Vec<usize>> {
        match self {
            Self::Grid(columns, rows) => Ok(busiest(view, columns * rows)),
            Self::Changes => {
                let mut changed: Vec<usize> = (0..view.frames.len()).collect();
                changed.retain(|k| *k == 0 || view.is_changed(*k));
                if changed.len() > MOST {
                    changed = busiest(view, MOST);
                }
                Ok(changed)
            }
            Self::Windows(windows) => windows.iter().map(|w| place(view, *w)).collect(),
        }
    }
}

fn place(view: &View, index: usize) -> Result<usize> {
    let last = view.frames.last().map_or(0, |f| f.index);
    let found = view.frames.iter().position(|f| f.index == index);
    found.ok_or_else(|| {
        let what = format!("there is no window {index}");
        Error::usage(what, format!("windows are counted from 0 to {last}"))
    })
}

/// The first window and those that change most; if too few change, others evenly spread.
fn busiest(view: &View, most: usize) -> Vec<usize> {
    let changes = |t: Counts| {
        let nodes = t.nodes_added + t.nodes_removed + t.restarted;
        let others = t.total() - nodes - t.rates;
        8 * nodes + 4 * others + t.rates
    };
    let mut order: Vec<usize> = (0..view.frames.len()).collect();
    order.sort_by_key(|k| {
        let changes = std::cmp::Reverse(changes(view.frames[*k].counts));
        (*k != 0, !view.is_changed(*k), changes, *k)
    });
    order.truncate(most.max(1));
    order.sort_unstable();
    order
}

#[cfg(test)]
mod tests;
