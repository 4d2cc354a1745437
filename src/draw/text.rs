//! The fonts: the width of a label in the bundled font, and the representation of characters that it lacks.

use std::borrow::Cow;
use std::fmt::Write as _;
use std::path::Path;
use std::sync::{Arc, LazyLock};

use skrifa::instance::{LocationRef, Size};
use skrifa::{FontRef, MetadataProvider as _};

use crate::base::error::{Error, Result};

/// The bundled font's Regular: a subset of Inter, see `styles/fonts/README.md`.
pub const REGULAR: &[u8] = include_bytes!("../../styles/fonts/Inter-Regular.ttf");
/// The bundled font's `SemiBold`.
pub const SEMIBOLD: &[u8] = include_bytes!("../../styles/fonts/Inter-SemiBold.ttf");

/// The weight of a text.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Weight {
    /// Weight 400.
    #[default]
    Regular,
    /// Weight 600.
    SemiBold,
}

impl Weight {
    /// Bold or not.
    pub fn of(is_bold: bool) -> Self {
        if is_bold {
            Self::SemiBold
        } else {
            Self::Regular
        }
    }
}

/// The width of every character of one font, in em.
#[derive(Debug)]
struct Face {
    data: Cow<'static, [u8]>,
    /// Each character with its width in em, sorted by character.
    advances: Vec<(u32, f32)>,
}

impl Face {
    /// The font of these bytes; `None` if they are not a font, or one without characters.
    fn read(data: Cow<'static, [u8]>) -> Option<Self> {
        let font = FontRef::from_index(&data, 0).ok()?;
        let metrics = font.metrics(Size::unscaled(), LocationRef::default());
        let em = f32::from(metrics.units_per_em.max(1));
        let widths = font.glyph_metrics(Size::unscaled(), LocationRef::default());
        let glyphs = font.charmap().mappings();
        let advances = glyphs.filter_map(|(c, glyph)| Some((c, widths.advance_width(glyph)? / em)));
        let mut advances: Vec<(u32, f32)> = advances.collect();
        advances.sort_by_key(|(c, _)| *c);
        advances.dedup_by_key(|(c, _)| *c);
        (!advances.is_empty()).then_some(Self { data, advances })
    }

    fn advance(&self, c: char) -> Option<f32> {
        let all = &self.advances;
        let at = all.binary_search_by_key(&u32::from(c), |(c, _)| *c);
        Some(all[at.ok()?].1)
    }
}

/// The fonts with which labels are measured and drawn: the bundled one, then the user's. Cheap to clone.
#[derive(Clone, Debug)]
pub struct Fonts {
    /// Regular and `SemiBold`, then the user's.
    faces: Vec<Arc<Face>>,
}

impl Default for Fonts {
    fn default() -> Self {
        Self::bundled()
    }
}

impl Fonts {
    /// The family name of the bundled font.
    pub const FAMILY: &'static str = "Inter";

    /// The bundled font alone.
    pub fn bundled() -> Self {
        // Read once: every SVG document is measured with them.
        static BUNDLED: LazyLock<Fonts> = LazyLock::new(|| {
            let face = |data| {
                let broken = Face {
                    data: Cow::Borrowed(data),
                    advances: Vec::new(),
                };
                Arc::new(Face::read(Cow::Borrowed(data)).unwrap_or(broken))
            };
            Fonts {
                faces: vec![face(REGULAR), face(SEMIBOLD)],
            }
        });
        BUNDLED.clone()
    }

    /// The fonts with one more for characters that the previous ones lack.
    ///
    /// # Errors
    /// [`Error::BadFile`] if `data`, read from `path`, is not a TrueType or OpenType font.
    pub fn with(mut self, data: Vec<u8>, path: &Path) -> Result<Self> {
        let face = Face::read(Cow::Owned(data));
        let face = face.ok_or_else(|| {
            let reason = "no TrueType or OpenType font with characters";
            Error::bad_file(path, 0, reason, "give `--font` a .ttf, .otf or .ttc file")
        })?;
        self.faces.push(Arc::new(face));
        Ok(self)
    }

    /// The bytes of the font files: Regular, `SemiBold`, then the user's.
    pub fn files(&self) -> impl Iterator<Item = &[u8]> {
        self.faces.iter().map(|face| &*face.data)
    }

    /// The fonts of a weight with their indices in [`Fonts::files`], the one to use first.
    fn of(&self, weight: Weight) -> impl Iterator<Item = (usize, &Face)> {
        let all = self.faces.iter().enumerate();
        let own = all.filter(move |(at, _)| *at == weight as usize || *at > 1);
        own.map(|(at, face)| (at, &**face))
    }

    /// The index in [`Fonts::files`] of the font that draws `c` in this weight; that of the weight if no font
    /// has it.
    pub fn file_of(&self, c: char, weight: Weight) -> usize {
        let found = self.of(weight).find(|(_, face)| face.advance(c).is_some());
        found.map_or(weight as usize, |(at, _)| at)
    }

    /// The width of `c` in em; `None` if no font has it.
    fn advance(&self, c: char, weight: Weight) -> Option<f32> {
        self.of(weight).find_map(|(_, face)| face.advance(c))
    }

    /// The width of `text` in pixels at a font size of `size` pixels; exact for the bundled font, which has no kerning.
    /// A character that no font has counts as one em.
    pub fn width(&self, text: &str, size: f64, weight: Weight) -> f64 {
        let advance = |c| f64::from(self.advance(c, weight).unwrap_or(1.0));
        text.chars().map(advance).sum::<f64>() * size
    }

    /// `text` in drawable form: control characters, invisible and direction marks, and characters that no
    /// font has, are written as `\u{…}`, so that different names never look the same.
    pub fn shown<'a>(&self, text: &'a str) -> Cow<'a, str> {
        if text.chars().all(|c| self.can_show(c)) {
            return Cow::Borrowed(text);
        }
        let mut out = String::new();
        for c in text.chars() {
            if self.can_show(c) {
                out.push(c);
            } else {
                let _ = write!(out, "\\u{{{:x}}}", u32::from(c));
            }
        }
        Cow::Owned(out)
    }

    /// The characters of `text` that have to be written as an escape, in order.
    pub fn missing<'a>(&'a self, text: &'a str) -> impl Iterator<Item = char> + 'a {
        text.chars().filter(|c| !self.can_show(*c))
    }

    fn can_show(&self, c: char) -> bool {
        !crate::base::words::is_invisible(c) && self.advance(c, Weight::Regular).is_some()
    }

    /// `text` shortened in the middle by `…` until it is at most `most` pixels wide; at least its ends are kept.
    pub fn fit<'a>(&self, text: &'a str, size: f64, weight: Weight, most: f64) -> Cow<'a, str> {
        if self.width(text, size, weight) <= most {
            return Cow::Borrowed(text);
        }
        let chars: Vec<char> = text.chars().collect();
        let short = |keep: usize| -> String {
            // The end of a name is more distinctive than its beginning.
            let head = keep * 2 / 5;
            let tail = &chars[chars.len() - (keep - head)..];
            chars[..head].iter().chain(&['…']).chain(tail).collect()
        };
        // The width grows with the length, so the longest text that fits is found by bisection.
        let most_kept = chars.len().saturating_sub(2);
        let (mut fits, mut wide) = (most_kept.min(2), most_kept + 1);
        while wide - fits > 1 {
            let keep = fits.midpoint(wide);
            if self.width(&short(keep), size, weight) <= most {
                fits = keep;
            } else {
                wide = keep;
            }
        }
        Cow::Owned(short(fits))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn widths_are_sums_of_advances() {
        let fonts = Fonts::bundled();
        let width = |t| fonts.width(t, 2048.0, Weight::Regular);
        assert!((width("scan") - (width("s") + width("c") + width("a") + width("n"))).abs() < 1e-6);
        assert!(
            fonts.width("scan", 10.0, Weight::SemiBold)
                > fonts.width("scan", 10.0, Weight::Regular)
        );
    }

    #[test]
    fn digits_have_equal_widths() {
        let fonts = Fonts::bundled();
        for weight in [Weight::Regular, Weight::SemiBold] {
            let of = |t: &str| fonts.width(t, 100.0, weight);
            assert!(
                "023456789"
                    .chars()
                    .all(|d| (of(&d.to_string()) - of("1")).abs() < 1e-3)
            );
        }
    }

    #[test]
    fn all_drawn_signs_are_in_the_font() {
        let fonts = Fonts::bundled();
        let signs = "≥≤×·→←−–—▲▼◆…éÿąłŠωΩЖя±²\"'&<>";
        assert_eq!(fonts.missing(signs).collect::<String>(), "");
    }

    #[test]
    fn missing_glyphs_are_spelled_out() {
        let fonts = Fonts::bundled();
        assert_eq!(fonts.shown("/scan"), "/scan");
        assert_eq!(fonts.shown("/机\n"), "/\\u{673a}\\u{a}");
        assert_eq!(fonts.shown("a\u{202e}b"), "a\\u{202e}b");
        assert_eq!(fonts.missing("机a").collect::<Vec<_>>(), ['机']);
    }

    #[test]
    fn long_names_keep_their_ends() {
        let fonts = Fonts::bundled();
        let name = "a_very_long_name_of_a_topic_that_nobody_should_ever_use";
        let short = fonts.fit(name, 12.0, Weight::Regular, 120.0);
        assert!(fonts.width(&short, 12.0, Weight::Regular) <= 120.0);
        assert!(
            short.starts_with("a_v") && short.ends_with("ever_use"),
            "{short}"
        );
        assert_eq!(fonts.fit("ab", 12.0, Weight::Regular, 0.0), "…");
    }

    #[test]
    fn a_file_that_is_not_a_font_is_refused() {
        let error = Fonts::bundled().with(b"no font".to_vec(), Path::new("x.ttf"));
        assert!(error.is_err_and(|e| e.to_string().contains("x.ttf")));
    }
}
