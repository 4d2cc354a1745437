//! A scene as pixels: its SVG, group by group, through usvg and resvg with the bundled font only.

mod canvas;
mod drawn;
mod tiles;

use std::collections::HashMap;
use std::sync::{Arc, PoisonError, RwLock};

use resvg::usvg::{self, Tree, fontdb};

pub use self::canvas::{Canvas, DrawnScene};
use self::drawn::Drawn;
use self::tiles::Tiles;
use crate::base::cast;
use crate::base::error::{Error, Result};
use crate::draw::paint::svg;
use crate::draw::scene::{Group, Scene};
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
            let hint =
                "this is a bug in bagreel; please report it with the picture's size and style";
            Error::usage(
                format!("the picture of `{}` cannot be drawn: {e}", group.title),
                hint,
            )
        })?;
        let tiles = Tiles::under(group, scene.size, &self.fonts);
        let page = (sheet.pixels.width, sheet.pixels.height);
        let drawn = Drawn::new(tree, sheet.scale, page);
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
        let (w, h) = (
            libm::round(scene.size.w * scale),
            libm::round(scene.size.h * scale),
        );
        if !(w >= 1.0 && h >= 1.0 && w <= MOST_SIDE && h <= MOST_SIDE && w * h <= MOST_PIXELS) {
            let hint = "use a `--size` of at most 65535 per side and 64 million pixels, such as `1920x1080`";
            return Err(Error::usage(
                format!("cannot draw a picture of {w} x {h} pixels"),
                hint,
            ));
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

#[cfg(test)]
mod tests;
