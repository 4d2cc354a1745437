//! Scenes as the pages of one PDF: vectors, text as text, each font embedded once.

use std::collections::BTreeMap;

use harfrust::{Direction, ShapeOptions, ShaperData, UnicodeBuffer};
use pdf_writer::types::{
    CidFontType, FontFlags, LineCapStyle, LineJoinStyle, SystemInfo, UnicodeCmap,
};
use pdf_writer::{Content, Filter, Finish as _, Name, Pdf, Rect as PdfRect, Ref, Str, TextStr};
use skrifa::instance::{LocationRef, Size};
use skrifa::metrics::GlyphMetrics;
use skrifa::outline::{DrawSettings, OutlinePen};
use skrifa::string::StringId;
use skrifa::{FontRef, GlyphId, MetadataProvider as _, Tag};
use subsetter::{GlyphRemapper, subset};

use crate::base::digest::zlib;
use crate::base::geometry::{Point, Rect};
use crate::draw::scene::{self, Form, Group, Piece, Scene, Shape, Step, Text};
use crate::draw::style::Color;
use crate::draw::text::Fonts;

/// Points per pixel, 96 pixels to the inch.
const PT_PER_PX: f64 = 0.75;
/// Points per millimetre.
const PT_PER_MM: f64 = 72.0 / 25.4;
/// The distance of the controls of a quarter of a circle from its ends, in radii.
const QUARTER: f64 = 0.552_284_75;

/// A page and its entry in the outline.
pub(crate) struct PdfPage {
    /// The drawing on the page.
    pub(crate) scene: Scene,
    /// Its entry in the outline.
    pub(crate) entry: String,
}

/// The document as a file's bytes. Pages are drawn as they arrive, so that only their vectors are kept in
/// memory.
///
/// # Errors
/// The reason why a font cannot be embedded.
pub(crate) fn write(
    pages: impl Iterator<Item = PdfPage>,
    fonts: &Fonts,
) -> std::result::Result<Vec<u8>, String> {
    let faces = fonts.files().map(PdfFont::read).collect();
    let mut pen = PdfPen { fonts, faces };
    let mut title = None;
    let mut drawn = Vec::new();
    for page in pages {
        drawn.push(pen.page(&page.scene, page.entry));
        title.get_or_insert(page.scene.title);
    }
    let mut file = PdfFile {
        pdf: Pdf::new(),
        last: 0,
    };
    // The version that every TeX accepts as a figure.
    file.pdf.set_version(1, 5);
    let [catalog, tree, outline, info] = file.ids();
    let mut used = Vec::new();
    for (place, face) in pen.faces.iter().enumerate() {
        if let Some(face) = face.as_ref().filter(|face| face.is_used()) {
            let ids: [Ref; 5] = file.ids();
            face.write(&mut file.pdf, ids[0])?;
            used.push((name(place), ids[0]));
        }
    }
    let pages = drawn.iter();
    let pages: Vec<Ref> = pages.map(|page| file.page(page, tree, &used)).collect();
    let count = i32::try_from(pages.len()).unwrap_or(i32::MAX);
    file.pdf
        .pages(tree)
        .kids(pages.iter().copied())
        .count(count);
    file.outline(outline, &drawn, &pages);
    file.pdf
        .catalog(catalog)
        .pages(tree)
        .outlines(outline)
        .lang(TextStr("en"));
    file.pdf
        .document_info(info)
        .title(TextStr(&title.unwrap_or_default()))
        .creator(TextStr("bagreel"));
    Ok(file.pdf.finish())
}

/// A drawn page.
struct DrawnPage {
    /// Its width and height in points.
    size: (f32, f32),
    content: Vec<u8>,
    entry: String,
}

/// A document in progress.
struct PdfFile {
    pdf: Pdf,
    last: i32,
}

impl PdfFile {
    fn ids<const N: usize>(&mut self) -> [Ref; N] {
        std::array::from_fn(|_| {
            self.last += 1;
            Ref::new(self.last)
        })
    }

    fn page(&mut self, drawn: &DrawnPage, tree: Ref, fonts: &[(String, Ref)]) -> Ref {
        let [id, content] = self.ids();
        let pdf = &mut self.pdf;
        let mut page = pdf.page(id);
        page.parent(tree)
            .media_box(PdfRect::new(0.0, 0.0, drawn.size.0, drawn.size.1))
            .contents(content);
        let mut resources = page.resources();
        let mut all = resources.fonts();
        for (name, font) in fonts {
            all.pair(Name(name.as_bytes()), *font);
        }
        all.finish();
        resources.finish();
        page.finish();
        pdf.stream(content, &drawn.content)
            .filter(Filter::FlateDecode);
        id
    }

    /// An entry per page.
    fn outline(&mut self, id: Ref, drawn: &[DrawnPage], pages: &[Ref]) {
        let entries: Vec<[Ref; 1]> = pages.iter().map(|_| self.ids()).collect();
        let mut outline = self.pdf.outline(id);
        if let (Some([first]), Some([last])) = (entries.first(), entries.last()) {
            let count = i32::try_from(entries.len()).unwrap_or(i32::MAX);
            outline.first(*first).last(*last).count(count);
        }
        outline.finish();
        for (place, (page, [entry])) in drawn.iter().zip(&entries).enumerate() {
            let mut item = self.pdf.outline_item(*entry);
            item.parent(id).title(TextStr(&page.entry));
            if let Some([before]) = place.checked_sub(1).and_then(|at| entries.get(at)) {
                item.prev(*before);
            }
            if let Some([after]) = entries.get(place + 1) {
                item.next(*after);
            }
            if let Some(target) = pages.get(place) {
                item.dest().page(*target).xyz(0.0, page.size.1, None);
            }
        }
    }
}

/// The name of a font.
fn name(place: usize) -> String {
    format!("F{place}")
}

/// A length on a page.
#[expect(clippy::cast_possible_truncation, reason = "lengths on a page")]
fn f(length: f64) -> f32 {
    length as f32
}

/// The pen that draws scenes on pages.
struct PdfPen<'a> {
    fonts: &'a Fonts,
    /// The fonts in the order of [`Fonts::files`]; `None` for one that cannot be read.
    faces: Vec<Option<PdfFont<'a>>>,
}

impl PdfPen<'_> {
    fn page(&mut self, scene: &Scene, entry: String) -> DrawnPage {
        let per_px = match scene.width_mm {
            Some(mm) => mm * PT_PER_MM / scene.size.w.max(1.0),
            None => PT_PER_PX,
        };
        let size = (f(scene.size.w * per_px), f(scene.size.h * per_px));
        let mut content = Content::new();
        let scale = f(per_px);
        content.transform([scale, 0.0, 0.0, -scale, 0.0, size.1]);
        let all = Rect::new(0.0, 0.0, scene.size.w, scene.size.h);
        let ground = Shape::filled(Form::Rect(all, 0.0), scene.background);
        shape(&mut content, &ground);
        for group in &scene.groups {
            self.group(&mut content, group);
        }
        DrawnPage {
            size,
            content: zlib(&content.finish(), 6),
            entry,
        }
    }

    fn group(&mut self, content: &mut Content, group: &Group) {
        for piece in &group.pieces {
            match piece {
                Piece::Shape(piece) => shape(content, piece),
                Piece::Text(text) => self.text(content, text),
            }
        }
    }

    fn text(&mut self, content: &mut Content, text: &Text) {
        let width = self.fonts.width(&text.text, text.size, text.weight);
        let start = Point::new(text.at.x - text.anchor.before(width), text.at.y);
        let (runs, size) = (self.runs(text, start), f(text.size));
        content.save_state();
        if let Some((color, width)) = text.halo {
            let halo = scene::Stroke::solid(color, width);
            if stroke(content, &halo, LineJoinStyle::RoundJoin) {
                // As an outline, so that a search finds the words only once.
                for (file, run) in &runs {
                    if let Some(Some(face)) = self.faces.get(*file) {
                        face.outline(content, run, size);
                    }
                }
                content.stroke();
            }
        }
        if fill(content, text.color) {
            for (file, run) in &runs {
                if let Some(Some(face)) = self.faces.get_mut(*file) {
                    face.show(content, Name(name(*file).as_bytes()), run, size);
                }
            }
        }
        content.restore_state();
    }

    /// A text in pieces, as its characters may be in several fonts: the font of each piece, and its glyphs.
    fn runs<'t>(&self, text: &'t Text, start: Point) -> Vec<(usize, Vec<Glyph<'t>>)> {
        let (mut at, mut rest, mut runs) = (start, text.text.as_str(), Vec::new());
        while let Some(first) = rest.chars().next() {
            let file = self.fonts.file_of(first, text.weight);
            let other = |c: char| self.fonts.file_of(c, text.weight) != file;
            let (run, after) = rest.split_at(rest.find(other).unwrap_or(rest.len()));
            if let Some(Some(face)) = self.faces.get(file) {
                runs.push((file, face.shape(run, (f(at.x), f(at.y)), f(text.size))));
            }
            at.x += self.fonts.width(run, text.size, text.weight);
            rest = after;
        }
        runs
    }
}

/// Sets the fill colour; returns whether there is one.
fn fill(content: &mut Content, color: Color) -> bool {
    let Some([r, g, b]) = color.rgb().map(shares) else {
        return false;
    };
    content.set_fill_rgb(r, g, b);
    true
}

/// Red, green and blue from 0 to 1.
fn shares(rgb: [u8; 3]) -> [f32; 3] {
    rgb.map(|value| f32::from(value) / 255.0)
}

/// Sets the stroke of paths; returns whether there is one.
fn stroke(content: &mut Content, stroke: &scene::Stroke, join: LineJoinStyle) -> bool {
    let rgb = stroke.color.rgb().filter(|_| stroke.width > 0.0);
    let Some([r, g, b]) = rgb.map(shares) else {
        return false;
    };
    // As in SVG.
    let miter_limit = 4.0;
    content
        .set_stroke_rgb(r, g, b)
        .set_line_width(f(stroke.width))
        .set_line_join(join)
        .set_miter_limit(miter_limit);
    if stroke.dash.iter().any(|d| *d > 0.0) {
        // SVG repeats an odd number of dashes to make it even, and so does PDF.
        content.set_dash_pattern(stroke.dash.iter().map(|d| f(*d)), 0.0);
        if stroke.is_round() {
            content.set_line_cap(LineCapStyle::RoundCap);
        }
    }
    true
}

fn shape(content: &mut Content, shape: &Shape) {
    content.save_state();
    let filled = fill(content, shape.fill);
    let lined = stroke(content, &shape.stroke, LineJoinStyle::MiterJoin);
    if (filled || lined) && path(content, &shape.form) {
        match (filled, lined) {
            (true, true) => content.fill_nonzero_and_stroke(),
            (true, false) => content.fill_nonzero(),
            _ => content.stroke(),
        };
    }
    content.restore_state();
}

/// Adds a path; returns whether it is not empty.
fn path(content: &mut Content, form: &Form) -> bool {
    match form {
        Form::Rect(rect, radius) => {
            let most = rect.w.min(rect.h) / 2.0;
            rounded(content, *rect, radius.min(most), radius.min(most));
        }
        Form::Ellipse(rect) => rounded(content, *rect, rect.w / 2.0, rect.h / 2.0),
        Form::Path(steps) => steps.iter().for_each(|step| add(content, *step)),
    }
    !matches!(form, Form::Path(steps) if steps.is_empty())
}

fn add(content: &mut Content, step: Step) {
    match step {
        Step::Move(p) => content.move_to(f(p.x), f(p.y)),
        Step::Line(p) => content.line_to(f(p.x), f(p.y)),
        Step::Curve([a, b, p]) => content.cubic_to(f(a.x), f(a.y), f(b.x), f(b.y), f(p.x), f(p.y)),
        Step::Close => content.close_path(),
    };
}
/// A rectangle with corners of these radii; an ellipse if they are half its sides.
fn rounded(content: &mut Content, rect: Rect, rx: f64, ry: f64) {
    let (left, top, right, bottom) = (rect.x, rect.y, rect.right(), rect.bottom());
    let (kx, ky) = (rx * (1.0 - QUARTER), ry * (1.0 - QUARTER));
    let at = Point::new;
    let steps = [
        Step::Move(at(left + rx, top)),
        Step::Line(at(right - rx, top)),
        Step::Curve([
            at(right - kx, top),
            at(right, top + ky),
            at(right, top + ry),
        ]),
        Step::Line(at(right, bottom - ry)),
        Step::Curve([
            at(right, bottom - ky),
            at(right - kx, bottom),
            at(right - rx, bottom),
        ]),
        Step::Line(at(left + rx, bottom)),
        Step::Curve([
            at(left + kx, bottom),
            at(left, bottom - ky),
            at(left, bottom - ry),
        ]),
        Step::Line(at(left, top + ry)),
        Step::Curve([at(left, top + ky), at(left + kx, top), at(left + rx, top)]),
        Step::Close,
    ];
    // Without corners or without sides, some steps have no length, which would be visible in dashes.
    let round = rx > 0.0 && ry > 0.0;
    let wanted = |step: &&Step| round || !matches!(step, Step::Curve(_));
    for step in steps.iter().filter(wanted) {
        add(content, *step);
    }
}

// A font in a PDF: text is shaped with it, and the glyphs in use are embedded once.

/// Glyphs are named by their number in the font.
const IDENTITY: SystemInfo<'static> = SystemInfo {
    registry: Str(b"Adobe"),
    ordering: Str(b"Identity"),
    supplement: 0,
};
/// Units of a width in a PDF, per em.
const PER_EM: f32 = 1000.0;

/// A font, and the glyphs written with it.
struct PdfFont<'a> {
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
struct Glyph<'t> {
    id: u16,
    at: (f32, f32),
    /// The part of the text that it shows first.
    shown: &'t str,
    /// Whether viewers place it correctly by the widths alone.
    is_regular: bool,
}

impl<'a> PdfFont<'a> {
    /// The font of a file; `None` if it cannot be read.
    fn read(file: &'a [u8]) -> Option<Self> {
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
    fn is_used(&self) -> bool {
        !self.texts.is_empty()
    }

    /// The glyphs of a text from left to right, from a point on its baseline.
    fn shape<'t>(&self, text: &'t str, at: (f32, f32), size: f32) -> Vec<Glyph<'t>> {
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
                let mut later = infos[place..].iter();
                let later = later.find(|next| next.cluster > info.cluster);
                let end = later.map_or(text.len(), |next| next.cluster as usize);
                let is_first = before.replace(info.cluster) != Some(info.cluster);
                let shown = text.get(info.cluster as usize..end).filter(|_| is_first);
                let id = u16::try_from(info.glyph_id).unwrap_or_default();
                let advance = to.x_advance as f32 / self.units;
                let (dx, dy) = (
                    to.x_offset as f32 / self.units,
                    to.y_offset as f32 / self.units,
                );
                let from = x;
                x += advance * size;
                Glyph {
                    id,
                    at: (from + dx * size, at.1 - dy * size),
                    shown: shown.unwrap_or_default(),
                    is_regular: (dx, dy) == (0.0, 0.0) && (advance - self.width(id)).abs() < 1e-6,
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
    fn show(&mut self, content: &mut Content, name: Name<'_>, text: &[Glyph<'_>], size: f32) {
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
    fn outline(&self, content: &mut Content, text: &[Glyph<'_>], size: f32) {
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
    fn write(&self, pdf: &mut Pdf, first: Ref) -> Result<(), String> {
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
        let [x_min, y_min] = [bounds.x_min, bounds.y_min].map(scaled);
        let [x_max, y_max] = [bounds.x_max, bounds.y_max].map(scaled);
        let mut descriptor = pdf.font_descriptor(id);
        descriptor
            .name(name)
            .flags(FontFlags::SYMBOLIC)
            .bbox(PdfRect::new(x_min, y_min, x_max, y_max))
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
        let name = name.flat_map(|text| text.chars().collect::<Vec<_>>());
        let is_plain = |c: &char| c.is_ascii_alphanumeric() || *c == '-';
        let name: String = name.filter(is_plain).take(60).collect();
        format!("{tag}+{name}")
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
