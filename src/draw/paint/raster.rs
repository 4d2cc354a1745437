//! A scene as pixels: its SVG, group by group, through usvg and resvg with the bundled font only.

use std::collections::HashMap;
use std::ops::Range;
use std::sync::{Arc, PoisonError, RwLock};

use resvg::usvg::{self, Tree, fontdb};
use tiny_skia::{Pixmap, PixmapMut, Transform};

use super::svg;
use crate::base::cast;
use crate::base::error::{Error, Result};
use crate::base::geometry::{Point, Rect, Size, after};
use crate::draw::scene::{Form, Group, Piece, Scene, Shape, Step, Text};
use crate::draw::style::Color;
use crate::draw::text::Fonts;

/// A picture of opaque pixels.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Pixels {
    /// Pixels from left to right, ≥ 1.
    pub width: u32,
    /// Pixels from top to bottom, ≥ 1.
    pub height: u32,
    /// Red, green, blue and 255 for each pixel, row by row from the top.
    pub rgba: Vec<u8>,
}

/// The widest and highest that a picture may be: the limit of GIF.
const MOST_SIDE: f64 = 65_535.0;
/// The most pixels in a picture: 256 MB of memory.
const MOST_PIXELS: f64 = 64e6;
/// The number of drawn groups in each of two generations that are cached for later frames: more than a page
/// contains, few enough for 20 MB.
const MOST_KEPT: usize = 1000;
/// The bytes of their pixels in each generation: about one page.
const MOST_BYTES: usize = 10 << 20;

/// A group, drawn once, and the tiles of the page that it may touch.
struct RasterGroup {
    drawn: Drawn,
    tiles: Tiles,
}

/// Rasterizes scenes. It may be shared among threads.
pub struct Painter {
    options: usvg::Options<'static>,
    fonts: Fonts,
    kept: RwLock<Kept>,
}

/// Drawn groups by their SVG, all of one scale: the recent ones, and those that were recent before them.
#[derive(Default)]
struct Kept {
    scale: f64,
    new: HashMap<String, Arc<RasterGroup>>,
    /// The bytes of the pixels of the new ones.
    bytes: usize,
    old: HashMap<String, Arc<RasterGroup>>,
}

impl Kept {
    fn get(&self, text: &str, scale: f64) -> Option<Arc<RasterGroup>> {
        let known = self.new.get(text).or_else(|| self.old.get(text));
        known.filter(|_| self.is_of(scale)).cloned()
    }

    fn is_of(&self, scale: f64) -> bool {
        self.scale.to_bits() == scale.to_bits()
    }

    fn insert(&mut self, text: String, group: Arc<RasterGroup>, scale: f64) {
        if !self.is_of(scale) {
            *self = Self {
                scale,
                ..Self::default()
            };
        }
        if self.new.len() >= MOST_KEPT || self.bytes >= MOST_BYTES {
            self.old = std::mem::take(&mut self.new);
            self.bytes = 0;
        }
        self.bytes += group.drawn.bytes();
        self.new.insert(text, group);
    }
}

impl Painter {
    /// A painter with only these fonts.
    pub fn new(fonts: &Fonts) -> Self {
        let mut db = fontdb::Database::new();
        for file in fonts.files() {
            db.load_font_data(file.to_vec());
        }
        db.set_sans_serif_family(Fonts::FAMILY);
        let options = usvg::Options {
            font_family: Fonts::FAMILY.to_owned(),
            fontdb: Arc::new(db),
            ..usvg::Options::default()
        };
        Self {
            options,
            fonts: fonts.clone(),
            kept: RwLock::default(),
        }
    }

    /// The scene in pixels, `scale` times as large.
    ///
    /// # Errors
    /// [`Error::Usage`] if the picture would have no pixels, a side of more than 65,535, or more than 64
    /// million pixels.
    pub fn paint(&self, scene: &Scene, scale: f64) -> Result<Pixels> {
        Ok(PixelSheet::covered(self, scene, scale, drop)?.pixels)
    }

    /// The group in pixels, from the cache if it was drawn before.
    fn read(&self, scene: &Scene, group: &Group, sheet: &PixelSheet) -> Result<Arc<RasterGroup>> {
        let text = svg::write_alone(scene, group);
        let known = self.kept.read().unwrap_or_else(PoisonError::into_inner);
        if let Some(drawn) = known.get(&text, sheet.scale) {
            return Ok(drawn);
        }
        drop(known);
        let tree = Tree::from_str(&text, &self.options).map_err(|e| {
            let what = format!("the picture of `{}` cannot be drawn: {e}", group.title);
            let hint =
                "this is a bug in bagreel; please report it with the picture's size and style";
            Error::usage(what, hint)
        })?;
        let tiles = Tiles::under(group, scene.size, &self.fonts);
        let page = (sheet.pixels.width, sheet.pixels.height);
        let drawn = match GroupPixels::of(&tree, sheet.scale, page) {
            Some(pixels) => Drawn::Pixels(pixels),
            None => Drawn::Tree(Box::new(tree)),
        };
        let group = Arc::new(RasterGroup { drawn, tiles });
        let mut kept = self.kept.write().unwrap_or_else(PoisonError::into_inner);
        kept.insert(text, Arc::clone(&group), sheet.scale);
        Ok(group)
    }
}

/// A page of pixels to draw on.
struct PixelSheet {
    /// All of them are opaque, so that premultiplied colours equal plain ones.
    pixels: Pixels,
    scale: f64,
}

impl PixelSheet {
    /// An empty page for the scene.
    fn of(scene: &Scene, scale: f64) -> Result<Self> {
        let [w, h] = [scene.size.w, scene.size.h].map(|side| libm::round(side * scale));
        if !(w >= 1.0 && h >= 1.0 && w <= MOST_SIDE && h <= MOST_SIDE && w * h <= MOST_PIXELS) {
            let hint = "use a `--size` of at most 65535 per side and 64 million pixels, such as `1920x1080`";
            let what = format!("cannot draw a picture of {w} x {h} pixels");
            return Err(Error::usage(what, hint));
        }
        let (width, height) = (cast::to_u32(w), cast::to_u32(h));
        let rgba = opaque(scene.background).repeat(width as usize * height as usize);
        let pixels = Pixels {
            width,
            height,
            rgba,
        };
        Ok(Self { pixels, scale })
    }

    /// A page with the whole scene; `keep` takes each of its groups once that is drawn.
    fn covered(
        painter: &Painter,
        scene: &Scene,
        scale: f64,
        mut keep: impl FnMut(Arc<RasterGroup>),
    ) -> Result<Self> {
        let mut sheet = Self::of(scene, scale)?;
        for group in &scene.groups {
            let group = painter.read(scene, group, &sheet)?;
            sheet.draw(&group);
            keep(group);
        }
        Ok(sheet)
    }

    /// Draws the whole scene over the former pixels.
    fn cover(&mut self, scene: &Scene, drawn: &[Arc<RasterGroup>]) {
        fill(&mut self.pixels.rgba, scene.background);
        for group in drawn {
            self.draw(group);
        }
    }

    fn draw(&mut self, group: &RasterGroup) {
        group.drawn.lay(self.scale, &mut self.pixels);
    }
}

/// Fills all pixels with a background.
fn fill(rgba: &mut [u8], background: Color) {
    let background = opaque(background);
    for pixel in rgba.chunks_exact_mut(4) {
        pixel.copy_from_slice(&background);
    }
}

/// The colour as a background pixel: white for [`Color::NONE`].
fn opaque(color: Color) -> [u8; 4] {
    let [r, g, b] = color.rgb().unwrap_or([255; 3]);
    [r, g, b, 255]
}

// Groups as they are composited onto pages: small ones as cached pixels, large ones as a tree to draw each
// time.

/// The largest number of pixels of a group that is cached as pixels: a box with its words has about ten
/// thousand.
const MOST_CACHED: f64 = 65_536.0;
/// Pixels around a group's box, for soft edges.
const MARGIN: f64 = 2.0;

/// A group in pixels of the page.
enum Drawn {
    Pixels(GroupPixels),
    Tree(Box<Tree>),
}

/// The pixels of a group that are not transparent: most of the area around lines is.
struct GroupPixels {
    runs: Vec<Run>,
    /// Premultiplied red, green, blue and alpha, run by run.
    rgba: Vec<u8>,
}

/// Pixels side by side.
struct Run {
    /// The number of pixels of the page before it.
    at: usize,
    length: usize,
}

impl Drawn {
    /// The number of cached bytes of its pixels.
    fn bytes(&self) -> usize {
        match self {
            Self::Pixels(pixels) => pixels.rgba.len() + size_of_val(&*pixels.runs),
            Self::Tree(_) => 0,
        }
    }

    /// Composites the group onto a page of opaque pixels.
    fn lay(&self, scale: f64, page: &mut Pixels) {
        match self {
            Self::Pixels(pixels) => pixels.lay(page),
            Self::Tree(tree) => {
                if let Some(mut map) =
                    PixmapMut::from_bytes(&mut page.rgba, page.width, page.height)
                {
                    resvg::render(tree, scaled(scale), &mut map);
                }
            }
        }
    }
}

impl GroupPixels {
    /// The pixels of the group of `tree` on a page of `page` pixels, `scale` times as large as its own size; `None` if there
    /// are too many.
    fn of(tree: &Tree, scale: f64, page: (u32, u32)) -> Option<Self> {
        let area = tree.root().abs_layer_bounding_box();
        let inside = |at: f64, most: u32| at.clamp(0.0, f64::from(most));
        let low = |at: f32, most| inside(libm::floor(f64::from(at) * scale - MARGIN), most);
        let high = |at: f32, most| inside(libm::ceil(f64::from(at) * scale + MARGIN), most);
        let (left, right) = (low(area.left(), page.0), high(area.right(), page.0));
        let (top, bottom) = (low(area.top(), page.1), high(area.bottom(), page.1));
        let (width, height) = (right - left, bottom - top);
        if width * height > MOST_CACHED {
            return None;
        }
        let [left, top, width, height] = [left, top, width, height].map(cast::to_u32);
        let mut map = Pixmap::new(width, height)?;
        #[expect(clippy::cast_precision_loss, reason = "at most 65,535")]
        let moved = scaled(scale).post_translate(-(left as f32), -(top as f32));
        resvg::render(tree, moved, &mut map.as_mut());
        let corner = (left as usize, top as usize);
        Some(Self::inked(&map, corner, page.0 as usize))
    }

    /// The pixels of `map` that are not transparent; its corner is at this column and row of a page `across`
    /// pixels wide.
    fn inked(map: &Pixmap, (left, top): (usize, usize), across: usize) -> Self {
        let (mut runs, mut rgba) = (Vec::new(), Vec::new());
        let rows = map.data().chunks_exact(map.width() as usize * 4);
        for (row, y) in rows.zip(top..) {
            let mut at = left + y * across;
            let pixels = row.as_chunks::<4>().0;
            for run in pixels.chunk_by(|a, b| (a[3] == 0) == (b[3] == 0)) {
                let length = run.len();
                if run[0][3] != 0 {
                    runs.push(Run { at, length });
                    rgba.extend_from_slice(run.as_flattened());
                }
                at += length;
            }
        }
        Self { runs, rgba }
    }

    fn lay(&self, page: &mut Pixels) {
        let mut from = &self.rgba[..];
        for run in &self.runs {
            let (now, later) = from.split_at(run.length * 4);
            let to = &mut page.rgba[run.at * 4..(run.at + run.length) * 4];
            for (to, from) in to.chunks_exact_mut(4).zip(now.chunks_exact(4)) {
                match from[3] {
                    255 => to.copy_from_slice(from),
                    alpha => over(to, from, 255 - alpha),
                }
            }
            from = later;
        }
    }
}

/// Composites a premultiplied pixel over an opaque one.
fn over(to: &mut [u8], from: &[u8], rest: u8) {
    for (to, from) in to.iter_mut().zip(&from[..3]) {
        let under = u32::from(*to) * u32::from(rest) + 128;
        // Division by 255, rounded.
        let under = (under + (under >> 8)) >> 8;
        *to = from.saturating_add(u8::try_from(under).unwrap_or(u8::MAX));
    }
}

#[expect(clippy::cast_possible_truncation, reason = "a scale near 1")]
fn scaled(scale: f64) -> Transform {
    Transform::from_scale(scale as f32, scale as f32)
}

// Frames one after another: only changed parts are redrawn, with the same pixels as a full redraw.

/// The largest share of changed tiles; above it, everything is redrawn, since clipping then costs more than it saves.
const MOST_SHARE: f64 = 0.7;

/// A scene with its pixels.
pub struct DrawnScene<'a> {
    /// The scene.
    pub scene: &'a Scene,
    /// Its pixels; none if it was not drawn.
    pub pixels: &'a Pixels,
    sheet: Option<(&'a PixelSheet, Option<&'a Tiles>)>,
}

impl<'a> DrawnScene<'a> {
    /// A scene that was not drawn.
    pub fn without_pixels(scene: &'a Scene) -> Self {
        const NOTHING: &Pixels = &Pixels {
            width: 0,
            height: 0,
            rgba: Vec::new(),
        };
        Self {
            scene,
            pixels: NOTHING,
            sheet: None,
        }
    }

    /// The bytes of the pixels that may differ from those of the scene before, from top to bottom.
    pub fn changed(&self) -> impl Iterator<Item = Range<usize>> + use<> {
        let rows = self.sheet;
        let rows = rows.and_then(|(sheet, dirty)| Some(sheet.rows(dirty?)));
        let all = rows.is_none().then_some(0..self.pixels.rgba.len());
        all.into_iter().chain(rows.into_iter().flatten())
    }
}

/// A page on which frames are drawn one after another; it stores the last one.
pub struct Canvas<'a> {
    painter: &'a Painter,
    scale: f64,
    last: Option<Last>,
}

struct Last {
    scene: Scene,
    drawn: Vec<Arc<RasterGroup>>,
    sheet: PixelSheet,
    scratch: PixelSheet,
    /// The tiles that differ from the previous scene; `None` for all of them.
    dirty: Option<Tiles>,
}

impl<'a> Canvas<'a> {
    /// An empty canvas; scenes on it are `scale` times as large.
    pub fn new(painter: &'a Painter, scale: f64) -> Self {
        Self {
            painter,
            scale,
            last: None,
        }
    }

    /// The scene in pixels, equal to [`Painter::paint`]; fast if little differs from the previous scene.
    ///
    /// # Errors
    /// As [`Painter::paint`].
    pub fn draw(&mut self, scene: Scene) -> Result<DrawnScene<'_>> {
        let last = match self.last.take() {
            Some(last) => last.followed_by(scene, self.painter)?,
            None => Last::first(scene, self.painter, self.scale)?,
        };
        let last = self.last.insert(last);
        Ok(DrawnScene {
            scene: &last.scene,
            pixels: &last.sheet.pixels,
            sheet: Some((&last.sheet, last.dirty.as_ref())),
        })
    }
}

impl Last {
    fn first(scene: Scene, painter: &Painter, scale: f64) -> Result<Self> {
        let mut drawn = Vec::with_capacity(scene.groups.len());
        Ok(Self {
            sheet: PixelSheet::covered(painter, &scene, scale, |group| drawn.push(group))?,
            scratch: PixelSheet::of(&scene, scale)?,
            scene,
            drawn,
            dirty: None,
        })
    }

    /// Redraws the parts that differ, or everything if there are too many.
    fn followed_by(mut self, scene: Scene, painter: &Painter) -> Result<Self> {
        if scene.size != self.scene.size || scene.background != self.scene.background {
            return Self::first(scene, painter, self.sheet.scale);
        }
        let stays = self.stays(&scene);
        let groups = scene.groups.iter().zip(&stays);
        let drawn = groups.map(|(group, stays)| match stays {
            Some(at) => Ok(Arc::clone(&self.drawn[*at])),
            None => painter.read(&scene, group, &self.sheet),
        });
        let drawn: Vec<_> = drawn.collect::<Result<_>>()?;
        let dirty = self.dirty(&scene, &drawn, &stays);
        match &dirty {
            // The groups that overlap these tiles are drawn, and only these tiles copied.
            Some(dirty) => {
                self.scratch.clear(dirty, &scene);
                for group in drawn.iter().filter(|d| d.tiles.meets(dirty)) {
                    self.scratch.draw(group);
                }
                self.sheet.copy(dirty, &self.scratch);
            }
            None => self.sheet.cover(&scene, &drawn),
        }
        Ok(Self {
            scene,
            drawn,
            dirty,
            ..self
        })
    }

    /// The index in the previous scene of each group that is equal there.
    fn stays(&self, scene: &Scene) -> Vec<Option<usize>> {
        let ids = self.scene.groups.iter().map(|group| group.id.as_str());
        let before: HashMap<&str, usize> = ids.zip(0..).collect();
        let same = |group: &Group| {
            let at = before.get(group.id.as_str()).copied();
            at.filter(|at| self.scene.groups[*at] == *group)
        };
        scene.groups.iter().map(same).collect()
    }

    /// The tiles under everything that differs; `None` if everything must be redrawn.
    fn dirty(
        &self,
        scene: &Scene,
        drawn: &[Arc<RasterGroup>],
        stays: &[Option<usize>],
    ) -> Option<Tiles> {
        // Unchanged groups must keep their order, or overlaps would differ.
        if !stays.iter().flatten().is_sorted() {
            return None;
        }
        let mut dirty = Tiles::none(scene.size);
        let new = drawn.iter().zip(stays).filter(|(_, stays)| stays.is_none());
        new.for_each(|(drawn, _)| dirty.extend(&drawn.tiles));
        let mut is_gone = vec![true; self.drawn.len()];
        stays.iter().flatten().for_each(|at| is_gone[*at] = false);
        let gone = self.drawn.iter().zip(&is_gone).filter(|(_, gone)| **gone);
        gone.for_each(|(drawn, _)| dirty.extend(&drawn.tiles));
        (dirty.share() <= MOST_SHARE).then_some(dirty)
    }
}

impl PixelSheet {
    /// The byte range of each row of pixels inside the tiles.
    fn rows(&self, tiles: &Tiles) -> impl Iterator<Item = Range<usize>> + use<> {
        let (width, height) = (self.pixels.width as usize, self.pixels.height as usize);
        let scale = self.scale;
        let edge = move |tile: usize, most: usize| {
            cast::to_usize(libm::floor(tile as f64 * SIDE * scale).min(most as f64))
        };
        tiles.spans().into_iter().flat_map(move |(columns, row)| {
            let (left, right) = (edge(columns.start, width), edge(columns.end, width));
            let lines = edge(row, height)..edge(row + 1, height);
            lines.map(move |y| (y * width + left) * 4..(y * width + right) * 4)
        })
    }

    fn clear(&mut self, tiles: &Tiles, scene: &Scene) {
        for row in self.rows(tiles) {
            fill(&mut self.pixels.rgba[row], scene.background);
        }
    }

    fn copy(&mut self, tiles: &Tiles, from: &Self) {
        for row in self.rows(tiles) {
            self.pixels.rgba[row.clone()].copy_from_slice(&from.pixels.rgba[row]);
        }
    }
}

// The parts of the page that a group may touch: a bit per square of the page, never too few.

/// The side of a tile in pixels of the page: about the height of a box.
const SIDE: f64 = 32.0;

/// A set of tiles of one page.
struct Tiles {
    columns: usize,
    rows: usize,
    bits: Vec<u64>,
}

impl Tiles {
    /// None of the tiles of a page of this size.
    fn none(page: Size) -> Self {
        let count = |length: f64| tile(length.min(1e6)) + 1;
        let (columns, rows) = (count(page.w), count(page.h));
        Self {
            columns,
            rows,
            bits: vec![0; (columns * rows).div_ceil(64)],
        }
    }

    /// The tiles that the group may touch.
    fn under(group: &Group, page: Size, fonts: &Fonts) -> Self {
        let mut tiles = Self::none(page);
        for piece in &group.pieces {
            match piece {
                Piece::Shape(shape) => tiles.add_shape(shape),
                Piece::Text(text) => tiles.add(text_box(text, fonts)),
            }
        }
        tiles
    }

    /// Adds all tiles of `other`, which is of the same page.
    fn extend(&mut self, other: &Self) {
        for (a, b) in self.bits.iter_mut().zip(&other.bits) {
            *a |= b;
        }
    }

    /// Whether a tile is in both.
    fn meets(&self, other: &Self) -> bool {
        self.bits.iter().zip(&other.bits).any(|(a, b)| a & b != 0)
    }

    /// The share of the page that is in it, 0..=1.
    fn share(&self) -> f64 {
        let set: u32 = self.bits.iter().map(|b| b.count_ones()).sum();
        f64::from(set) / (self.columns * self.rows) as f64
    }

    /// The tiles in it, row by row: the columns of those side by side, and their row.
    fn spans(&self) -> Vec<(Range<usize>, usize)> {
        let mut spans: Vec<(Range<usize>, usize)> = Vec::new();
        for (column, row) in self.iter() {
            match spans.last_mut() {
                Some((columns, at)) if *at == row && columns.end == column => columns.end += 1,
                _ => spans.push((column..column + 1, row)),
            }
        }
        spans
    }

    /// The tiles in it as (column, row), row by row.
    fn iter(&self) -> impl Iterator<Item = (usize, usize)> + '_ {
        let all = (0..self.rows).flat_map(|row| (0..self.columns).map(move |column| (column, row)));
        all.filter(|(column, row)| {
            let at = row * self.columns + column;
            self.bits[at / 64] >> (at % 64) & 1 == 1
        })
    }

    fn add(&mut self, area: Rect) {
        let (left, right) = (tile(area.x), tile(area.right()).min(self.columns - 1));
        let (top, bottom) = (tile(area.y), tile(area.bottom()).min(self.rows - 1));
        for row in top..=bottom {
            for at in row * self.columns + left..=row * self.columns + right {
                if left <= right {
                    self.bits[at / 64] |= 1 << (at % 64);
                }
            }
        }
    }

    fn add_shape(&mut self, shape: &Shape) {
        // Half the width, up to four times that at a pointed corner, and more for antialiasing and rounding.
        let reach = shape.stroke.width.max(0.0) * 2.0 + 3.0;
        match &shape.form {
            Form::Rect(rect, _) | Form::Ellipse(rect) => self.add(rect.grown(reach)),
            Form::Path(steps) if shape.fill == Color::NONE => self.add_line(steps, reach),
            Form::Path(steps) => {
                let points = steps.iter().flat_map(Step::points).copied();
                if let Some(area) = Rect::of_points(points) {
                    self.add(area.grown(reach));
                }
            }
        }
    }

    fn add_line(&mut self, steps: &[Step], reach: f64) {
        let (mut first, mut here) = (Point::default(), Point::default());
        for step in steps {
            let curve = match step {
                Step::Move(p) => {
                    (first, here) = (*p, *p);
                    continue;
                }
                Step::Line(p) => [here, here, *p, *p],
                Step::Curve([a, b, end]) => [here, *a, *b, *end],
                Step::Close => [here, here, first, first],
            };
            self.add_curve(curve, reach, 5);
            here = curve[3];
        }
    }

    /// Adds the tiles of a curve, which lies inside the box of its controls: it is halved until that box is small.
    fn add_curve(&mut self, curve: [Point; 4], reach: f64, depth: u8) {
        let Some(area) = Rect::of_points(curve) else {
            return;
        };
        if depth == 0 || (area.w < SIDE && area.h < SIDE) {
            self.add(area.grown(reach));
            return;
        }
        let mut backwards = curve;
        backwards.reverse();
        self.add_curve(after(curve, 0.5), reach, depth - 1);
        self.add_curve(after(backwards, 0.5), reach, depth - 1);
    }
}

/// The tile index of a coordinate; coordinates before the page are in the first tile.
fn tile(at: f64) -> usize {
    cast::to_usize((at / SIDE).clamp(0.0, 1e6))
}

fn text_box(text: &Text, fonts: &Fonts) -> Rect {
    let width = fonts.width(&text.text, text.size, text.weight);
    let left = text.at.x - text.anchor.before(width);
    let halo = text.halo.map_or(0.0, |(_, width)| width);
    // Above and below any letter of our fonts; half an em on each side for overhanging letters.
    Rect::new(left, text.at.y - 1.3 * text.size, width, 1.8 * text.size)
        .grown(0.5 * text.size + halo + 3.0)
}

#[cfg(test)]
mod tests;
