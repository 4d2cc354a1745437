//! Scenes as the pages of one PDF: vectors, text as text, each font embedded once.

use harfrust::{Direction, FontRef, ShapeOptions, ShaperData, UnicodeBuffer};
use krilla::color::rgb;
use krilla::configure::{ConfigurationBuilder, PdfVersion};
use krilla::destination::XyzDestination;
use krilla::geom::{self, PathBuilder, Transform};
use krilla::metadata::Metadata;
use krilla::num::NormalizedF32;
use krilla::outline::{Outline, OutlineNode};
use krilla::page::PageSettings;
use krilla::paint::{Fill, LineCap, LineJoin, Stroke, StrokeDash};
use krilla::surface::Surface;
use krilla::text::{Font, GlyphId, KrillaGlyph};
use krilla::{Document, SerializeSettings};

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

/// The document as a file's bytes. Pages are drawn as they come, so that only their vectors are held.
///
/// # Errors
/// The reason for which the writer of PDF refuses it, in its own words.
pub(crate) fn write(
    sheets: impl Iterator<Item = PdfPage>,
    fonts: &Fonts,
) -> std::result::Result<Vec<u8>, String> {
    // What every TeX takes as a figure.
    let version = ConfigurationBuilder::new().with_version(PdfVersion::Pdf15);
    let mut document = Document::new_with(SerializeSettings {
        configuration: version.finish().map_err(|e| format!("{e:?}"))?,
        ..SerializeSettings::default()
    });
    let faces = fonts.files().map(PdfFace::read).collect();
    let pen = PdfPen { fonts, faces };
    let mut outline = Outline::new();
    let mut title = None;
    for (place, sheet) in sheets.enumerate() {
        let scene = &sheet.scene;
        let per_px = match scene.width_mm {
            Some(mm) => mm * PT_PER_MM / scene.size.w.max(1.0),
            None => PT_PER_PX,
        };
        let size = geom::Size::from_wh(f(scene.size.w * per_px), f(scene.size.h * per_px));
        let size = size.ok_or("a page without a size")?;
        let mut page = document.start_page_with(PageSettings::new(size));
        let mut surface = page.surface();
        surface.push_transform(&Transform::from_scale(f(per_px), f(per_px)));
        pen.page(&mut surface, scene);
        surface.pop();
        surface.finish();
        page.finish();
        let top = XyzDestination::new(place, geom::Point::from_xy(0.0, 0.0));
        outline.push_child(OutlineNode::new(sheet.entry, top));
        title.get_or_insert(sheet.scene.title);
    }
    document.set_outline(outline);
    let metadata = Metadata::new()
        .creator("bagreel".to_owned())
        .language("en".to_owned());
    document.set_metadata(metadata.title(title.unwrap_or_default()));
    document.finish().map_err(|e| e.to_string())
}

/// A length for krilla.
#[expect(clippy::cast_possible_truncation, reason = "lengths on a page")]
fn f(length: f64) -> f32 {
    length as f32
}

fn point(p: Point) -> geom::Point {
    geom::Point::from_xy(f(p.x), f(p.y))
}

/// The pen that draws scenes on a page.
struct PdfPen<'a> {
    fonts: &'a Fonts,
    /// The fonts in the order of [`Fonts::files`]; `None` for one that cannot be read.
    faces: Vec<Option<PdfFace<'a>>>,
}

/// A font as the document embeds it and as its text is shaped.
struct PdfFace<'a> {
    embedded: Font,
    font: FontRef<'a>,
    shaper: ShaperData,
}

impl<'a> PdfFace<'a> {
    fn read(file: &'a [u8]) -> Option<Self> {
        let embedded = Font::new(file.to_vec().into(), 0)?;
        let font = FontRef::from_index(file, 0).ok()?;
        let shaper = ShaperData::new(&font);
        Some(Self {
            embedded,
            font,
            shaper,
        })
    }

    /// The glyphs of a text from left to right, in em.
    fn shape(&self, text: &str) -> Vec<KrillaGlyph> {
        let mut buffer = UnicodeBuffer::new();
        buffer.push_str(text);
        buffer.guess_segment_properties();
        buffer.set_direction(Direction::LeftToRight);
        let shaper = self.shaper.shaper(&self.font).build();
        let out = shaper.shape(buffer, ShapeOptions::new());
        let em = self.embedded.units_per_em();
        let (infos, positions) = (out.glyph_infos(), out.glyph_positions());
        let glyphs = infos
            .iter()
            .zip(positions)
            .enumerate()
            .map(|(at, (info, to))| {
                let later = infos[at..].iter().find(|next| next.cluster > info.cluster);
                let end = later.map_or(text.len(), |next| next.cluster as usize);
                KrillaGlyph::new(
                    GlyphId::new(info.glyph_id),
                    to.x_advance as f32 / em,
                    to.x_offset as f32 / em,
                    to.y_offset as f32 / em,
                    to.y_advance as f32 / em,
                    info.cluster as usize..end,
                    None,
                )
            });
        glyphs.collect()
    }
}

impl PdfPen<'_> {
    fn page(&self, surface: &mut Surface<'_>, scene: &Scene) {
        let all = Rect::new(0.0, 0.0, scene.size.w, scene.size.h);
        shape(
            surface,
            &Shape::filled(Form::Rect(all, 0.0), scene.background),
        );
        for group in &scene.groups {
            let faded = group.fade.0 < 1.0;
            if faded {
                surface.push_opacity(opacity(group.fade.0));
            }
            self.group(surface, group);
            if faded {
                surface.pop();
            }
        }
    }

    fn group(&self, surface: &mut Surface<'_>, group: &Group) {
        for piece in &group.pieces {
            match piece {
                Piece::Shape(piece) => shape(surface, piece),
                Piece::Text(text) => self.text(surface, text),
            }
        }
    }

    fn text(&self, surface: &mut Surface<'_>, text: &Text) {
        let width = self.fonts.width(&text.text, text.size, text.weight);
        let start = Point::new(text.at.x - text.anchor.before(width), text.at.y);
        if let Some((color, width)) = text.halo {
            // As an outline, so that the words are found once and not twice.
            surface.set_fill(None);
            let halo = scene::Stroke::solid(color, width);
            surface.set_stroke(stroke(&halo, LineJoin::Round));
            self.words(surface, text, start, true);
        }
        surface.set_stroke(None);
        surface.set_fill(fill(text.color));
        self.words(surface, text, start, false);
    }

    /// Writes a text, piece by piece where its characters are in several fonts.
    fn words(&self, surface: &mut Surface<'_>, text: &Text, start: Point, outlined: bool) {
        let mut at = start;
        let mut rest = text.text.as_str();
        while let Some(first) = rest.chars().next() {
            let file = self.fonts.file_of(first, text.weight);
            let other = |c: char| self.fonts.file_of(c, text.weight) != file;
            let (run, after) = rest.split_at(rest.find(other).unwrap_or(rest.len()));
            if let Some(Some(face)) = self.faces.get(file) {
                surface.draw_glyphs(
                    point(at),
                    &face.shape(run),
                    face.embedded.clone(),
                    run,
                    f(text.size),
                    outlined,
                );
            }
            at.x += self.fonts.width(run, text.size, text.weight);
            rest = after;
        }
    }
}

fn opacity(value: f64) -> NormalizedF32 {
    NormalizedF32::new(f(value.clamp(0.0, 1.0))).unwrap_or(NormalizedF32::ONE)
}

fn fill(color: Color) -> Option<Fill> {
    let [r, g, b] = color.rgb()?;
    Some(Fill {
        paint: rgb::Color::new(r, g, b).into(),
        ..Fill::default()
    })
}

fn stroke(stroke: &scene::Stroke, line_join: LineJoin) -> Option<Stroke> {
    let [r, g, b] = stroke.color.rgb().filter(|_| stroke.width > 0.0)?;
    let dashed = stroke.dash.iter().any(|d| *d > 0.0);
    // SVG repeats an odd number of dashes to make it even; PDF does the same by itself.
    let dash = dashed.then(|| StrokeDash {
        array: stroke.dash.iter().map(|d| f(*d)).collect(),
        offset: 0.0,
    });
    let round = dashed && stroke.is_round();
    Some(Stroke {
        paint: rgb::Color::new(r, g, b).into(),
        width: f(stroke.width),
        line_cap: if round { LineCap::Round } else { LineCap::Butt },
        line_join,
        // As SVG has it.
        miter_limit: 4.0,
        dash,
        ..Stroke::default()
    })
}

fn shape(surface: &mut Surface<'_>, shape: &Shape) {
    let (fill, stroke) = (fill(shape.fill), stroke(&shape.stroke, LineJoin::Miter));
    if fill.is_none() && stroke.is_none() {
        return;
    }
    if let Some(path) = path(&shape.form) {
        surface.set_fill(fill);
        surface.set_stroke(stroke);
        surface.draw_path(&path);
    }
}

fn path(form: &Form) -> Option<geom::Path> {
    let mut path = PathBuilder::new();
    match form {
        Form::Rect(rect, radius) => {
            let most = rect.w.min(rect.h) / 2.0;
            rounded(&mut path, *rect, radius.min(most), radius.min(most));
        }
        Form::Ellipse(rect) => rounded(&mut path, *rect, rect.w / 2.0, rect.h / 2.0),
        Form::Path(steps) => steps.iter().for_each(|step| add(&mut path, *step)),
    }
    path.finish()
}

fn add(path: &mut PathBuilder, step: Step) {
    match step {
        Step::Move(p) => path.move_to(f(p.x), f(p.y)),
        Step::Line(p) => path.line_to(f(p.x), f(p.y)),
        Step::Curve([a, b, p]) => path.cubic_to(f(a.x), f(a.y), f(b.x), f(b.y), f(p.x), f(p.y)),
        Step::Close => path.close(),
    }
}

/// A rectangle with corners of these radii; an ellipse where they are half its sides.
fn rounded(path: &mut PathBuilder, rect: Rect, rx: f64, ry: f64) {
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
    // Without corners or without sides some steps lead nowhere, which would show in dashes.
    let round = rx > 0.0 && ry > 0.0;
    let wanted = |step: &&Step| round || !matches!(step, Step::Curve(_));
    steps
        .iter()
        .filter(wanted)
        .for_each(|step| add(path, *step));
}
