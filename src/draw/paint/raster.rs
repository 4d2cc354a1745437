//! A scene as pixels: its SVG, group by group, through usvg and resvg with the bundled font only.

mod canvas;
mod tiles;

use std::collections::HashMap;
use std::sync::{Arc, PoisonError, RwLock};

use resvg::tiny_skia::{self, Pixmap, Transform};
use resvg::usvg::{self, Tree, fontdb};

pub use self::canvas::Canvas;
use self::tiles::Tiles;
use crate::base::error::{Error, Result};
use crate::draw::paint::svg;
use crate::draw::scene::{Group, Scene};
use crate::draw::style::Color;
use crate::draw::text::Fonts;

/// A picture of opaque pixels.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Pixels {
    /// Pixels from left to right, 1...
    pub width: u32,
    /// Pixels from top to bottom, 1...
    pub height: u32,
    /// Red, green, blue and 255 for each pixel, row by row from the top.
    pub rgba: Vec<u8>,
}

/// The widest and highest that a picture may be: the limit of GIF.
const MOST_SIDE: f64 = 65_535.0;
/// The most pixels in a picture: 256 MB of memory.
const MOST_PIXELS: f64 = 64e6;
/// How many drawn groups are kept, so that the next frame need not read their SVG again.
const MOST_KEPT: usize = 20_000;

/// A group, read once: its tree and the tiles of the page that it may touch.
struct Drawn {
    tree: Tree,
    tiles: Tiles,
}

/// Turns scenes into pixels. It may be shared among threads.
pub struct Painter {
    options: usvg::Options<'static>,
    fonts: Fonts,
    kept: RwLock<HashMap<String, Arc<Drawn>>>,
}

impl Painter {
    /// A painter with these fonts and no others.
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
    /// [`Error::Usage`] where the picture would have no pixels, a side of more than 65,535, or more than 64 million
    /// pixels.
    pub fn paint(&self, scene: &Scene, scale: f64) -> Result<Pixels> {
        let read = |group| self.read(scene, group);
        let drawn: Vec<_> = scene.groups.iter().map(read).collect::<Result<_>>()?;
        Ok(Sheet::covered(scene, &drawn, scale)?.into_pixels())
    }

    /// The group's tree, from memory where it was drawn before.
    fn read(&self, scene: &Scene, group: &Group) -> Result<Arc<Drawn>> {
        let text = svg::write_alone(scene, group);
        let known = self.kept.read().unwrap_or_else(PoisonError::into_inner);
        if let Some(drawn) = known.get(&text) {
            return Ok(Arc::clone(drawn));
        }
        drop(known);
        let tree = Tree::from_str(&text, &self.options).map_err(|e| {
            let hint =
                "this is a mistake of ours; please report it with the picture's size and style";
            Error::usage(
                format!("the picture of `{}` cannot be drawn: {e}", group.title),
                hint,
            )
        })?;
        let tiles = Tiles::under(group, scene.size, &self.fonts);
        let drawn = Arc::new(Drawn { tree, tiles });
        let mut kept = self.kept.write().unwrap_or_else(PoisonError::into_inner);
        if kept.len() >= MOST_KEPT {
            kept.clear();
        }
        kept.insert(text, Arc::clone(&drawn));
        Ok(drawn)
    }
}

/// A sheet of pixels to draw on.
struct Sheet {
    map: Pixmap,
    scale: f64,
}

impl Sheet {
    /// An empty sheet for the scene.
    fn of(scene: &Scene, scale: f64) -> Result<Self> {
        let (w, h) = (
            libm::round(scene.size.w * scale),
            libm::round(scene.size.h * scale),
        );
        let fits = w >= 1.0 && h >= 1.0 && w <= MOST_SIDE && h <= MOST_SIDE && w * h <= MOST_PIXELS;
        #[expect(
            clippy::cast_possible_truncation,
            clippy::cast_sign_loss,
            reason = "at most 65,535, checked above"
        )]
        let map = fits.then(|| Pixmap::new(w as u32, h as u32)).flatten();
        let mut map = map.ok_or_else(|| {
            let hint =
                "give `--size` at most 65535 a side and 64 million pixels, such as `1920x1080`";
            Error::usage(format!("cannot draw a picture of {w} x {h} pixels"), hint)
        })?;
        map.fill(opaque(scene.background));
        Ok(Self { map, scale })
    }

    /// A sheet with the whole scene on it.
    fn covered(scene: &Scene, drawn: &[Arc<Drawn>], scale: f64) -> Result<Self> {
        let mut sheet = Self::of(scene, scale)?;
        for group in drawn {
            sheet.draw(group);
        }
        Ok(sheet)
    }

    fn draw(&mut self, drawn: &Drawn) {
        #[expect(clippy::cast_possible_truncation, reason = "a scale near 1")]
        let scale = self.scale as f32;
        let transform = Transform::from_scale(scale, scale);
        resvg::render(&drawn.tree, transform, &mut self.map.as_mut());
    }

    /// Every pixel is opaque, so what tiny-skia calls premultiplied is plain.
    fn into_pixels(self) -> Pixels {
        Pixels {
            width: self.map.width(),
            height: self.map.height(),
            rgba: self.map.take(),
        }
    }
}

/// The colour as a background: white where it is none.
fn opaque(color: Color) -> tiny_skia::Color {
    let [r, g, b] = color.rgb().unwrap_or([255; 3]);
    tiny_skia::Color::from_rgba8(r, g, b, 255)
}

#[cfg(test)]
mod tests;
