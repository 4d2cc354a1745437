//! Styles: every colour, stroke and font size, read from `styles/*.toml`; no colour literals exist anywhere
//! else.

use std::fmt;
use std::path::Path;

use serde::{Deserialize, Deserializer, de};
use toml::de::DeTable;
use toml::{Spanned, Table, Value};

use super::text::Weight;
use crate::base::cast;
use crate::base::error::{Error, Result};

/// The built-in styles by name; the first is the default and complete, the others contain only the keys that differ from
/// their `base`.
pub const BUILTIN: &[(&str, &str)] = &[
    ("light", include_str!("../../styles/light.toml")),
    ("dark", include_str!("../../styles/dark.toml")),
    ("paper", include_str!("../../styles/paper.toml")),
    ("rqt", include_str!("../../styles/rqt.toml")),
];

/// Declares the kinds of sections with their keys.
macro_rules! sections {
    ($($Type:ident { $($key:ident: $value:ty),* $(,)? })*) => {
        $(#[derive(Clone, Debug, PartialEq, Deserialize)]
        pub(crate) struct $Type { $(pub(crate) $key: $value),* })*
    };
}

sections! {
    Page { background: Color, margin: f64, text: Color, quiet: Color, spotlight: f64 }
    Title {
        fill: Color, line: Color, text: Color, quiet: Color, added: Color, removed: Color, changed: Color,
        size: f64, quiet_size: f64, clock_size: f64, height: f64,
    }
    Legend { fill: Color, line: Color, text: Color, size: f64 }
    Timeline { past: Color, future: Color, now: Color, head: Color, axis: Color, text: Color, size: f64, height: f64 }
    Cluster { fill: Color, stroke: Color, width: f64, dash: Vec<f64>, radius: f64, text: Color, size: f64 }
    Body {
        fill: Color, stroke: Color, width: f64, radius: f64, text: Color, size: f64, bold: bool,
        pad_x: f64, pad_y: f64, small: f64,
    }
    Stack { depth: f64 }
    Edge {
        stroke: Color, width: f64, per_decade: f64, most: f64, arrow: f64,
        text: Color, size: f64, halo: Color, halo_width: f64,
    }
    Quiet { fill: Color, stroke: Color, text: Color, width: f64, dash: Vec<f64> }
    Latched { stroke: Color, bar: f64 }
    Stated { width: f64 }
    Inferred { dash: Vec<f64> }
    Change { glow: Color, color: Color, fill: Color, text: Color, width: f64, dash: Vec<f64> }
    Badge { glow: f64, radius: f64, sign: Color, halo: Color }
    CountBadge {
        added: Color, added_text: Color, removed: Color, removed_text: Color, changed: Color, changed_text: Color,
    }
}

/// The look of pictures; a section of the file per field, explained in `styles/light.toml`.
#[derive(Clone, Debug, PartialEq, Deserialize)]
pub struct Style {
    pub(crate) page: Page,
    pub(crate) title: Title,
    pub(crate) legend: Legend,
    pub(crate) timeline: Timeline,
    pub(crate) cluster: Cluster,
    pub(crate) node: Body,
    pub(crate) topic: Body,
    pub(crate) stack: Stack,
    pub(crate) edge: Edge,
    pub(crate) silent: Quiet,
    pub(crate) latched: Latched,
    pub(crate) declared: Quiet,
    pub(crate) stated: Stated,
    pub(crate) inferred: Inferred,
    pub(crate) added: Change,
    pub(crate) removed: Change,
    pub(crate) changed: Change,
    pub(crate) badge: Badge,
    pub(crate) count: CountBadge,
}

impl Body {
    /// Whether nodes are rounded boxes; otherwise ellipses, as in `rqt_graph`, if the corners of other boxes
    /// are not rounded either.
    pub(crate) fn is_capsule(&self) -> bool {
        self.radius > 0.0
    }

    /// The weight of its names.
    pub(crate) fn weight(&self) -> Weight {
        Weight::of(self.bold)
    }
}

impl Style {
    /// The built-in style of this name.
    ///
    /// # Errors
    /// [`Error::Usage`] if there is none; the hint lists them.
    pub fn builtin(name: &str) -> Result<Self> {
        Self::from_toml(builtin_text(name)?, Path::new(name))
    }

    /// The style that `text`, read from `path`, describes: its keys override those of the built-in style
    /// named as `base` (default `light`).
    ///
    /// # Errors
    /// [`Error::BadFile`] with the line, for a text that is not TOML, an unknown section or key, or a value of the
    /// wrong kind.
    pub fn from_toml(text: &str, path: &Path) -> Result<Self> {
        let file = StyleFile::read(text, path)?;
        let mut keys = match file.values.get("base") {
            None => complete(BUILTIN[0].1, path)?,
            Some(Value::String(base)) => builtin_text(base)
                .and_then(|text| complete(text, path))
                .map_err(|e| file.bad(&["base"], e.to_string()))?,
            Some(_) => {
                return Err(file.bad(&["base"], "`base` does not name a style".to_owned()));
            }
        };
        file.overlay(&mut keys)?;
        let bad = |e: toml::de::Error| Error::bad_file(path, 0, e.message(), HINT);
        keys.try_into().map_err(bad)
    }

    /// The style for paper, where space is scarce: names of [`PRINTED_NAMES`] pixels before they are scaled to their size
    /// in print, and all other text of this share of it.
    pub(crate) fn printed(mut self, others: f64) -> Self {
        let by = PRINTED_NAMES / self.node.size;
        let (names, others) = (PRINTED_NAMES, PRINTED_NAMES * others);
        for body in [&mut self.node, &mut self.topic] {
            body.pad_x *= by * PRINTED_PAD;
            body.pad_y *= by * PRINTED_PAD;
            (body.radius, body.width) = (body.radius * by, body.width * by);
            (body.size, body.small) = (names, others);
        }
        (self.topic.size, self.edge.size, self.cluster.size) = (others, others, others);
        self.edge.halo_width *= by;
        self.page.margin = PRINTED_MARGIN;
        self.stack.depth *= by;
        // Signs beside letters of 7 pt, not of 10.
        self.badge.radius *= PRINTED_BADGE;
        self.badge.glow *= PRINTED_BADGE;
        self
    }

    /// The look of a node that is away: the colour of removed elements, dotted like declared ones.
    pub(crate) fn away(&self) -> Quiet {
        Quiet {
            fill: Color::NONE,
            stroke: self.removed.color,
            text: self.removed.color,
            width: self.removed.width,
            dash: self.declared.dash.clone(),
        }
    }

    /// The colour behind everything.
    pub fn background(&self) -> Color {
        self.page.background
    }
}

/// The size of names on paper in pixels, before scaling. The distances between boxes and lines are pixels, too, so that
/// larger letters make a closer drawing: with 22, lines touch the words of others.
pub(crate) const PRINTED_NAMES: f64 = 18.0;
/// The share of the space around names that remains on paper, where letters are sharper than on a screen.
const PRINTED_PAD: f64 = 0.75;
/// The space around a graph on paper: enough for a badge and a glow.
const PRINTED_MARGIN: f64 = 6.5;
/// The share of the size of badges and glows that remains on paper.
const PRINTED_BADGE: f64 = 0.6;

const HINT: &str = "print a complete style with every key explained: `bagreel styles light`";

/// The text of the built-in style of this name.
///
/// # Errors
/// [`Error::Usage`] if there is none; the hint lists them.
pub fn builtin_text(name: &str) -> Result<&'static str> {
    let found = BUILTIN.iter().find(|(known, _)| *known == name);
    found.map(|(_, text)| *text).ok_or_else(|| {
        let names: Vec<_> = BUILTIN.iter().map(|(name, _)| *name).collect();
        let names = names.join(", ");
        let hint = format!("styles: {names}; or the path of a file of your own");
        Error::usage(format!("unknown style `{name}`"), hint)
    })
}

/// All keys of a built-in style: its own override those of the first.
fn complete(text: &str, path: &Path) -> Result<Table> {
    let mut keys: Table = BUILTIN[0].1.parse().unwrap_or_default();
    StyleFile::read(text, path)?.overlay(&mut keys)?;
    Ok(keys)
}

/// A style file with the positions of its keys.
struct StyleFile<'a> {
    text: &'a str,
    path: &'a Path,
    values: Table,
    places: Spanned<DeTable<'a>>,
}

impl<'a> StyleFile<'a> {
    fn read(text: &'a str, path: &'a Path) -> Result<Self> {
        let no_toml = |e: toml::de::Error| {
            let line = e.span().map_or(0, |span| line_at(text, span.start));
            Error::bad_file(path, line, e.message().replace('\n', " "), HINT)
        };
        Ok(Self {
            text,
            path,
            values: text.parse().map_err(no_toml)?,
            places: DeTable::parse(text).map_err(no_toml)?,
        })
    }

    /// The error for the value at `[section]` or `[section, key]`.
    fn bad(&self, at: &[&str], reason: String) -> Error {
        let mut table = Some(self.places.get_ref());
        let mut line = 0;
        for key in at {
            let found = table.and_then(|t| t.iter().find(|(k, _)| k.get_ref() == key));
            line = found.map_or(line, |(k, _)| line_at(self.text, k.span().start));
            table = found.and_then(|(_, value)| value.get_ref().as_table());
        }
        Error::bad_file(self.path, line, reason, HINT)
    }

    /// Overrides `keys`, which contains all sections, keys and their kinds, with this file's values.
    fn overlay(&self, keys: &mut Table) -> Result<()> {
        for (section, value) in self.values.iter().filter(|(name, _)| *name != "base") {
            let known = keys.get_mut(section).and_then(Value::as_table_mut);
            let known = known
                .ok_or_else(|| self.bad(&[section], format!("unknown section `{section}`")))?;
            let table = value.as_table();
            let table = table
                .ok_or_else(|| self.bad(&[section], format!("`{section}` is not a section")))?;
            for (key, value) in table {
                let at = [section.as_str(), key.as_str()];
                let old = known.get_mut(key);
                let old = old.ok_or_else(|| {
                    self.bad(&at, format!("unknown key `{key}` in `[{section}]`"))
                })?;
                if let Some(kind) = misfit(old, value) {
                    return Err(self.bad(&at, format!("`{key}` must be {kind}, not `{value}`")));
                }
                *old = value.clone();
            }
        }
        Ok(())
    }
}

/// The kind of value required to replace `old`; `None` if `new` is of that kind.
fn misfit(old: &Value, new: &Value) -> Option<&'static str> {
    let length = |v: &Value| {
        #[expect(clippy::cast_precision_loss, reason = "only its range matters")]
        let number = v.as_float().or_else(|| v.as_integer().map(|n| n as f64));
        number.is_some_and(|n| (0.0..=500.0).contains(&n))
    };
    let (fits, kind) = match old {
        Value::String(_) => (
            new.as_str().and_then(Color::parse).is_some(),
            "a colour such as `#1B2430`, or `none`",
        ),
        Value::Boolean(_) => (new.is_bool(), "`true` or `false`"),
        Value::Array(_) => (
            new.as_array()
                .is_some_and(|a| a.len() <= 8 && a.iter().all(length)),
            "a list of at most 8 lengths of 0 to 500 pixels",
        ),
        _ => (length(new), "a length of 0 to 500 pixels"),
    };
    (!fits).then_some(kind)
}

/// The line of a byte, counted from 1.
fn line_at(text: &str, byte: usize) -> usize {
    text.bytes().take(byte).filter(|b| *b == b'\n').count() + 1
}

/// A colour, or none.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct Color(Option<[u8; 3]>);

impl Color {
    /// The colour that draws nothing.
    pub const NONE: Self = Self(None);

    /// The colour of red, green and blue.
    pub const fn of(rgb: [u8; 3]) -> Self {
        Self(Some(rgb))
    }

    /// Red, green and blue; `None` for no colour.
    pub fn rgb(self) -> Option<[u8; 3]> {
        self.0
    }

    /// Reads `#RRGGBB` or `none`.
    pub(super) fn parse(text: &str) -> Option<Self> {
        if text == "none" {
            return Some(Self::NONE);
        }
        let hex = text.strip_prefix('#').filter(|hex| hex.len() == 6)?;
        hex.chars().all(|c| c.is_ascii_hexdigit()).then_some(())?;
        let byte = |at: usize| u8::from_str_radix(&hex[at..at + 2], 16).ok();
        Some(Self(Some([byte(0)?, byte(2)?, byte(4)?])))
    }

    /// The mixture with `part` (0..=1) of a background; itself if one of them is none.
    #[must_use]
    pub(crate) fn faded(self, background: Self, part: f64) -> Self {
        let both = self.0.and(background.0);
        both.map_or(self, |_| self.towards(background, part))
    }

    /// The mixture with `part` (0..=1) of `other`; if one of them is none, the nearer.
    #[must_use]
    pub fn towards(self, other: Self, part: f64) -> Self {
        let (Some(a), Some(b)) = (self.0, other.0) else {
            return if part < 0.5 { self } else { other };
        };
        let mix = |at: usize| {
            let (a, b) = (f64::from(a[at]), f64::from(b[at]));
            cast::to_u8(libm::round(a + (b - a) * part.clamp(0.0, 1.0)))
        };
        Self(Some([mix(0), mix(1), mix(2)]))
    }
}

impl fmt::Display for Color {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.0 {
            Some([r, g, b]) => write!(f, "#{r:02X}{g:02X}{b:02X}"),
            None => f.write_str("none"),
        }
    }
}

impl<'de> Deserialize<'de> for Color {
    fn deserialize<D: Deserializer<'de>>(from: D) -> Result<Self, D::Error> {
        let text = String::deserialize(from)?;
        Self::parse(&text).ok_or_else(|| de::Error::custom("no colour"))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn read(text: &str) -> Result<Style> {
        Style::from_toml(text, Path::new("mine.toml"))
    }

    fn refusal(text: &str) -> String {
        read(text).unwrap_err().to_string()
    }

    #[test]
    fn every_builtin_style_is_complete() {
        for (name, _) in BUILTIN {
            assert!(Style::builtin(name).is_ok(), "{name}");
        }
        assert_ne!(
            Style::builtin("light").unwrap(),
            Style::builtin("dark").unwrap()
        );
    }

    #[test]
    fn a_printed_style_round_trips() {
        for (name, text) in BUILTIN {
            assert_eq!(read(text).unwrap(), Style::builtin(name).unwrap(), "{name}");
        }
    }

    #[test]
    fn a_style_may_be_partial() {
        let mine = read("base = \"dark\"\n[added]\ncolor = \"#0000ff\"\nwidth = 4").unwrap();
        let dark = Style::builtin("dark").unwrap();
        assert_eq!(mine.added.color.to_string(), "#0000FF");
        assert!((mine.added.width - 4.0).abs() < 1e-9);
        assert_eq!(mine.removed, dark.removed);
    }

    #[test]
    fn errors_name_file_line_and_key() {
        let e = refusal("[node]\nfill = \"#FFFFFF\"\nfil = 3");
        assert_eq!(e, "`mine.toml` line 3: unknown key `fil` in `[node]`");
        assert!(refusal("\n[nodes]\n").contains("line 2: unknown section `nodes`"));
        assert!(refusal("[node]\nfill = \"blue\"").contains("line 2: `fill` must be a colour"));
        assert!(refusal("[node]\n\nsize = -1").contains("line 3: `size` must be a length"));
        assert!(refusal("[node]\nsize = nan").contains("a length"));
        assert!(refusal("node = 3").contains("line 1: `node` is not a section"));
        assert!(refusal("base = \"neon\"").contains("line 1: unknown style `neon`"));
        assert!(refusal("[node\nfill").contains("line 1"));
    }

    /// Contrast as WCAG 2 defines it, 1..=21.
    fn contrast(a: Color, b: Color) -> f64 {
        let light = |color: Color| {
            let linear = color.rgb().unwrap_or([255; 3]).map(|channel| {
                let c = f64::from(channel) / 255.0;
                if c <= 0.039_28 {
                    c / 12.92
                } else {
                    libm::pow((c + 0.055) / 1.055, 2.4)
                }
            });
            0.2126 * linear[0] + 0.7152 * linear[1] + 0.0722 * linear[2] + 0.05
        };
        let (a, b) = (light(a), light(b));
        a.max(b) / a.min(b)
    }

    #[test]
    fn every_line_and_text_has_contrast_to_its_ground() {
        for (name, _) in BUILTIN {
            let style = Style::builtin(name).unwrap();
            let page = style.background();
            let or_page = |fill: Color| if fill == Color::NONE { page } else { fill };
            let graph = [page, or_page(style.cluster.fill)];
            let (node, topic) = (or_page(style.node.fill), or_page(style.topic.fill));
            let (title, legend) = (&style.title, style.legend.fill);
            let mut pairs = vec![
                (4.5, style.legend.text, vec![legend, style.timeline.future]),
                (4.5, style.timeline.text, vec![legend]),
                (4.5, style.page.text, vec![page, legend]),
                (4.5, style.page.quiet, vec![graph[0], graph[1], node, topic]),
                (4.5, style.cluster.text, graph.to_vec()),
                (4.5, style.node.text, vec![node]),
                (4.5, style.topic.text, vec![topic]),
                (
                    4.5,
                    style.edge.text,
                    vec![graph[0], graph[1], style.edge.halo],
                ),
                (3.0, style.node.stroke, graph.to_vec()),
                (3.0, style.topic.stroke, graph.to_vec()),
                (3.0, style.edge.stroke, graph.to_vec()),
            ];
            let words = [
                title.text,
                title.quiet,
                title.added,
                title.removed,
                title.changed,
            ];
            pairs.extend(words.map(|color| (4.5, color, vec![title.fill])));
            for quiet in [&style.silent, &style.declared] {
                pairs.push((3.0, quiet.stroke, graph.to_vec()));
                pairs.push((4.5, quiet.text, graph.to_vec()));
            }
            let count = &style.count;
            let counts = [
                (count.added_text, count.added),
                (count.removed_text, count.removed),
                (count.changed_text, count.changed),
            ];
            pairs.extend(counts.map(|(text, fill)| (4.5, text, vec![fill])));
            for change in [&style.added, &style.removed, &style.changed] {
                let fill = or_page(change.fill);
                pairs.push((4.5, change.text, vec![fill]));
                pairs.push((4.5, change.color, vec![fill, graph[0], graph[1]]));
                pairs.push((4.5, style.badge.sign, vec![change.color]));
            }
            for (least, color, grounds) in pairs {
                for ground in grounds {
                    let found = contrast(color, ground);
                    assert!(found >= least, "{name}: {color} on {ground} is {found:.2}");
                }
            }
        }
    }

    #[test]
    fn colours_mix() {
        let (black, white) = (
            Color::parse("#000000").unwrap(),
            Color::parse("#ffffff").unwrap(),
        );
        assert_eq!(black.towards(white, 0.5).to_string(), "#808080");
        assert_eq!(Color::NONE.towards(white, 0.6), white);
        assert_eq!(Color::parse("#12345"), None);
        assert_eq!(Color::parse("#+2345f"), None);
    }
}
