//! Scenes as the pages of one PDF: vectors, text as text, each font embedded once.

mod font;

use pdf_writer::types::{LineCapStyle, LineJoinStyle};
use pdf_writer::writers::Resources;
use pdf_writer::{Content, Filter, Finish as _, Name, Pdf, Rect as PdfRect, Ref, TextStr};

use self::font::{Glyph, PdfFont};
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
            used.push((name('F', place), ids[0]));
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
        add_fonts(&mut page.resources(), fonts);
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

fn add_fonts(resources: &mut Resources<'_>, fonts: &[(String, Ref)]) {
    let mut all = resources.fonts();
    for (name, font) in fonts {
        all.pair(Name(name.as_bytes()), *font);
    }
}

/// The name of a resource.
fn name(kind: char, place: usize) -> String {
    format!("{kind}{place}")
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
                    face.show(content, Name(name('F', *file).as_bytes()), run, size);
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
    steps
        .iter()
        .filter(wanted)
        .for_each(|step| add(content, *step));
}
