//! A font in a PDF: text is shaped with it, and the glyphs in use are embedded once.

use std::collections::BTreeMap;

use harfrust::{Direction, ShapeOptions, ShaperData, UnicodeBuffer};
use pdf_writer::types::{CidFontType, FontFlags, SystemInfo, UnicodeCmap};
use pdf_writer::{Content, Filter, Finish as _, Name, Pdf, Rect, Ref, Str};
use skrifa::instance::{LocationRef, Size};
use skrifa::metrics::GlyphMetrics;
use skrifa::outline::{DrawSettings, OutlinePen};
use skrifa::string::StringId;
use skrifa::{FontRef, GlyphId, MetadataProvider as _, Tag};
use subsetter::{GlyphRemapper, subset};

use crate::base::digest::zlib;

/// Glyphs are named by their number in the font.
const IDENTITY: SystemInfo<'static> = SystemInfo {
    registry: Str(b"Adobe"),
    ordering: Str(b"Identity"),
    supplement: 0,
};
/// Units of a width in a PDF, per em.
const PER_EM: f32 = 1000.0;

/// A font, and the glyphs written with it.
pub(super) struct PdfFont<'a> {
    font: FontRef<'a>,
    shaper: ShaperData,
    file: &'a [u8],
    widths: GlyphMetrics<'a>,
    units: f32,
    used: GlyphRemapper,
    /// The text of each glyph in the document's font, for searching and copying.
    texts: BTreeMap<u16, String>,
}

/// A shaped glyph.
pub(super) struct Glyph<'t> {
    id: u16,
    at: (f32, f32),
    /// The part of the text that it shows first.
    shown: &'t str,
    /// Whether viewers place it correctly by the widths alone.
    is_regular: bool,
}

impl<'a> PdfFont<'a> {
    /// The font of a file; `None` if it cannot be read.
    pub(super) fn read(file: &'a [u8]) -> Option<Self> {
        let font = FontRef::from_index(file, 0).ok()?;
        let metrics = font.metrics(Size::unscaled(), LocationRef::default());
        Some(Self {
            shaper: ShaperData::new(&font),
            widths: font.glyph_metrics(Size::unscaled(), LocationRef::default()),
            units: f32::from(metrics.units_per_em.max(1)),
            font,
            file,
            used: GlyphRemapper::new(),
            texts: BTreeMap::new(),
        })
    }

    /// Whether any text was written with it.
    pub(super) fn is_used(&self) -> bool {
        !self.texts.is_empty()
    }

    /// The glyphs of a text from left to right, from a point on its baseline.
    pub(super) fn shape<'t>(&self, text: &'t str, at: (f32, f32), size: f32) -> Vec<Glyph<'t>> {
        let mut buffer = UnicodeBuffer::new();
        buffer.push_str(text);
        buffer.guess_segment_properties();
        buffer.set_direction(Direction::LeftToRight);
        let shaper = self.shaper.shaper(&self.font).build();
        let out = shaper.shape(buffer, ShapeOptions::new());
        let (infos, positions) = (out.glyph_infos(), out.glyph_positions());
        let (mut before, mut x) = (None, at.0);
        let glyphs = infos
            .iter()
            .zip(positions)
            .enumerate()
            .map(|(place, (info, to))| {
                let later = infos[place..]
                    .iter()
                    .find(|next| next.cluster > info.cluster);
                let end = later.map_or(text.len(), |next| next.cluster as usize);
                let is_first = before.replace(info.cluster) != Some(info.cluster);
                let shown = text.get(info.cluster as usize..end).filter(|_| is_first);
                let id = u16::try_from(info.glyph_id).unwrap_or_default();
                let advance = to.x_advance as f32 / self.units;
                let offset = (
                    to.x_offset as f32 / self.units,
                    to.y_offset as f32 / self.units,
                );
                let from = x;
                x += advance * size;
                Glyph {
                    id,
                    at: (from + offset.0 * size, at.1 - offset.1 * size),
                    shown: shown.unwrap_or_default(),
                    is_regular: offset == (0.0, 0.0) && (advance - self.width(id)).abs() < 1e-6,
                }
            });
        glyphs.collect()
    }

    /// The width of a glyph in em.
    fn width(&self, id: u16) -> f32 {
        let width = self.widths.advance_width(GlyphId::from(id));
        width.unwrap_or_default() / self.units
    }

    /// Writes a text in runs whose glyphs are at their natural positions.
    pub(super) fn show(
        &mut self,
        content: &mut Content,
        name: Name<'_>,
        text: &[Glyph<'_>],
        size: f32,
    ) {
        let (mut run, mut start) = (Vec::new(), (0.0, 0.0));
        content.begin_text();
        content.set_font(name, size);
        let mut flush = |run: &mut Vec<u8>, start: (f32, f32)| {
            if !run.is_empty() {
                content.set_text_matrix([1.0, 0.0, 0.0, -1.0, start.0, start.1]);
                content.show(Str(run));
                run.clear();
            }
        };
        for glyph in text {
            let id = self.used.remap(glyph.id);
            self.learn(id, glyph.shown);
            if run.is_empty() || !glyph.is_regular {
                flush(&mut run, start);
                start = glyph.at;
            }
            run.extend(id.to_be_bytes());
            if !glyph.is_regular {
                flush(&mut run, start);
            }
        }
        flush(&mut run, start);
        content.end_text();
    }

    /// Records the text of a glyph; a single character takes precedence.
    fn learn(&mut self, id: u16, shown: &str) {
        let known = self.texts.entry(id).or_default();
        if known.is_empty() || shown.chars().count() == 1 && known.chars().count() > 1 {
            shown.clone_into(known);
        }
    }

    /// Adds the outlines of a text to the path.
    pub(super) fn outline(&self, content: &mut Content, text: &[Glyph<'_>], size: f32) {
        let outlines = self.font.outline_glyphs();
        for glyph in text {
            let mut pen = PathPen {
                content,
                origin: glyph.at,
                scale: size / self.units,
                last: (0.0, 0.0),
            };
            let settings = DrawSettings::unhinted(Size::unscaled(), LocationRef::default());
            if let Some(outline) = outlines.get(GlyphId::from(glyph.id)) {
                // A glyph that cannot be read has no outline.
                let _ = outline.draw(settings, &mut pen);
            }
        }
    }

    /// Writes the font with the glyphs in use as five objects, the first of which is `first`.
    ///
    /// # Errors
    /// The reason why its glyphs cannot be extracted.
    pub(super) fn write(&self, pdf: &mut Pdf, first: Ref) -> Result<(), String> {
        let [whole, cid, described, stream, cmap] =
            [0, 1, 2, 3, 4].map(|next| Ref::new(first.get() + next));
        let subset = subset(self.file, 0, &self.used).map_err(|e| e.to_string())?;
        let cff = FontRef::new(&subset).ok();
        let cff = cff.and_then(|font| font.table_data(Tag::new(b"CFF ")));
        let name = self.name(first);
        let name = Name(name.as_bytes());

        pdf.type0_font(whole)
            .base_font(name)
            .encoding_predefined(Name(b"Identity-H"))
            .descendant_font(cid)
            .to_unicode(cmap);
        let mut font = pdf.cid_font(cid);
        font.base_font(name)
            .system_info(IDENTITY)
            .font_descriptor(described)
            .default_width(0.0);
        match cff {
            Some(_) => font.subtype(CidFontType::Type0),
            None => font
                .subtype(CidFontType::Type2)
                .cid_to_gid_map_predefined(Name(b"Identity")),
        };
        let glyphs = self.used.remapped_gids();
        font.widths()
            .consecutive(0, glyphs.map(|id| self.width(id) * PER_EM));
        font.finish();
        self.describe(pdf, described, name, stream, cff.is_some());

        let data = zlib(cff.map_or(&*subset, |table| table.as_bytes()), 6);
        let mut file = pdf.stream(stream, &data);
        file.filter(Filter::FlateDecode);
        if cff.is_some() {
            file.pair(Name(b"Subtype"), Name(b"CIDFontType0C"));
        }
        file.finish();
        let mut texts = UnicodeCmap::new(Name(b"Custom"), IDENTITY);
        for (glyph, text) in self.texts.iter().filter(|(_, text)| !text.is_empty()) {
            texts.pair_with_multiple(*glyph, text.chars());
        }
        let texts = zlib(&texts.finish(), 6);
        pdf.cmap(cmap, &texts).filter(Filter::FlateDecode);
        Ok(())
    }

    fn describe(&self, pdf: &mut Pdf, id: Ref, name: Name<'_>, file: Ref, is_cff: bool) {
        let metrics = self.font.metrics(Size::unscaled(), LocationRef::default());
        let scaled = |length: f32| length * PER_EM / self.units;
        let bounds = metrics.bounds.unwrap_or_default();
        let mut descriptor = pdf.font_descriptor(id);
        descriptor
            .name(name)
            .flags(FontFlags::SYMBOLIC)
            .bbox(Rect::new(
                scaled(bounds.x_min),
                scaled(bounds.y_min),
                scaled(bounds.x_max),
                scaled(bounds.y_max),
            ))
            .italic_angle(metrics.italic_angle)
            .ascent(scaled(metrics.ascent))
            .descent(scaled(metrics.descent))
            .cap_height(scaled(metrics.cap_height.unwrap_or(metrics.ascent)))
            // Required, but only used by viewers that replace the font.
            .stem_v(80.0);
        if is_cff {
            descriptor.font_file3(file);
        } else {
            descriptor.font_file2(file);
        }
    }

    /// The name of the font with a unique tag, as required for subsets (ISO 32000-1, 9.6.4).
    fn name(&self, first: Ref) -> String {
        let mut number = first.get();
        let tag: String = std::iter::repeat_with(|| {
            let letter = u8::try_from(number % 26).unwrap_or_default();
            number /= 26;
            char::from(b'A' + letter)
        })
        .take(6)
        .collect();
        let name = self.font.localized_strings(StringId::POSTSCRIPT_NAME);
        let name: String = name
            .flat_map(|text| text.chars().collect::<Vec<_>>())
            .collect();
        let is_plain = |c: &char| c.is_ascii_alphanumeric() || *c == '-';
        format!(
            "{tag}+{}",
            name.chars().filter(is_plain).take(60).collect::<String>()
        )
    }
}

/// Draws outlines of a font as a path, with the y axis flipped.
struct PathPen<'c> {
    content: &'c mut Content,
    origin: (f32, f32),
    scale: f32,
    last: (f32, f32),
}

impl PathPen<'_> {
    fn placed(&self, x: f32, y: f32) -> (f32, f32) {
        (
            self.origin.0 + x * self.scale,
            self.origin.1 - y * self.scale,
        )
    }
}

impl OutlinePen for PathPen<'_> {
    fn move_to(&mut self, x: f32, y: f32) {
        self.last = (x, y);
        let (x, y) = self.placed(x, y);
        self.content.move_to(x, y);
    }

    fn line_to(&mut self, x: f32, y: f32) {
        self.last = (x, y);
        let (x, y) = self.placed(x, y);
        self.content.line_to(x, y);
    }

    fn quad_to(&mut self, cx: f32, cy: f32, x: f32, y: f32) {
        let toward = |from: f32, to: f32| from + (to - from) * 2.0 / 3.0;
        let (from_x, from_y) = self.last;
        self.curve_to(
            toward(from_x, cx),
            toward(from_y, cy),
            toward(x, cx),
            toward(y, cy),
            x,
            y,
        );
    }

    fn curve_to(&mut self, ax: f32, ay: f32, bx: f32, by: f32, x: f32, y: f32) {
        self.last = (x, y);
        let ((ax, ay), (bx, by)) = (self.placed(ax, ay), self.placed(bx, by));
        let (x, y) = self.placed(x, y);
        self.content.cubic_to(ax, ay, bx, by, x, y);
    }

    fn close(&mut self) {
        self.content.close_path();
    }
}
