//! The ids, classes and attributes of groups in SVG, and the names that the font cannot show.

use std::collections::BTreeSet;
use std::fmt::Write as _;

use super::texts;
use crate::base::notice::{Notice, NoticeKind};
use crate::base::words;
use crate::draw::text::Fonts;
use crate::view::{Arrow, ArrowKind, Item, ItemKind, Mark, Shown, View};

/// The notice about names with characters that no font contains; `None` if there are none.
pub fn unshown(view: &View, fonts: &Fonts) -> Option<Notice> {
    let items = view.items.iter();
    let items = items.chain(view.rows.iter().map(|row| &row.item));
    let names = items.map(|item| &*item.name);
    let missing: BTreeSet<char> = names.flat_map(|name| fonts.missing(name)).collect();
    let spelled = missing.iter().map(|c| c.escape_unicode().to_string());
    let some = words::some_of(&spelled.collect::<Vec<_>>(), 3);
    let text = format!(
        "names contain characters that the font lacks, drawn as {some}; add a font with `--font FILE`"
    );
    (!missing.is_empty()).then(|| Notice::new(NoticeKind::Glyph, text))
}

pub(super) fn item_id(item: &Item) -> String {
    let prefix = if item.kind.word() == "node" { "n" } else { "t" };
    format!("{prefix}{}", encoded(&item.name))
}

pub(super) fn arrow_id(arrow: &Arrow, ends: &[String; 2]) -> String {
    let [from, to] = ends.each_ref().map(|name| encoded(name));
    match &arrow.kind {
        ArrowKind::Publish => format!("p{from}..{to}"),
        ArrowKind::Subscribe => format!("s{from}..{to}"),
        ArrowKind::Direct(topic) => format!("d{from}..{to}..{}", encoded(topic)),
        ArrowKind::Bundle => format!("b{from}..{to}"),
    }
}

/// A name as part of an XML id, different for different names: `/` becomes `-`, anything but letters, digits and `_`
/// becomes `.` with its number in six hexadecimal digits.
pub(super) fn encoded(name: &str) -> String {
    let mut out = String::with_capacity(name.len());
    for c in name.chars() {
        match c {
            '/' => out.push('-'),
            '_' | 'a'..='z' | 'A'..='Z' | '0'..='9' => out.push(c),
            _ => {
                let _ = write!(out, ".{:06x}", u32::from(c));
            }
        }
    }
    out
}

/// The attributes of a box.
pub(crate) fn data(item: &Item, shown: &Shown) -> Vec<(&'static str, String)> {
    let mut data = vec![
        ("name", item.name.to_string()),
        ("state", shown.state.word().to_owned()),
    ];
    data.extend(shown.mark.map(|mark| ("mark", mark.word().to_owned())));
    let counted = item.counted.iter();
    let counted: Vec<&str> = counted.chain(&shown.unlined).map(|name| &**name).collect();
    if !counted.is_empty() {
        data.push(("topics", counted.join(" ")));
    }
    let members = shown.members.number();
    data.extend(members.map(|(number, _)| ("members", number.to_string())));
    reported(data, shown)
}

/// The attributes of an element, with the log indices of its headlines in this window.
pub(crate) fn reported(
    mut data: Vec<(&'static str, String)>,
    shown: &Shown,
) -> Vec<(&'static str, String)> {
    if !shown.events.is_empty() {
        let places: Vec<String> = shown.events.iter().map(ToString::to_string).collect();
        data.push(("entries", places.join(" ")));
    }
    data
}

/// The class words of an element, `node added active measured`: its kind, its mark, its state, its confidence.
pub(crate) fn class(what: &str, shown: &Shown) -> String {
    let mut words = vec![what];
    words.extend(shown.mark.map(Mark::class));
    words.extend([shown.state.word(), shown.confidence.word()]);
    if matches!(shown.mark, Some(Mark::HandedOver)) {
        words.push("handed-over");
    }
    if matches!(shown.mark, Some(Mark::Restarted)) {
        words.push("restarted");
    }
    if shown.is_starved {
        words.push("starved");
    }
    words.dedup();
    words.join(" ")
}

pub(crate) fn title(item: &Item, shown: &Shown) -> String {
    let what = match item.kind {
        ItemKind::Node => "node",
        _ if item.is_service => "service",
        ItemKind::Topic => "topic",
        ItemKind::Group => "topics",
        ItemKind::Namespace => "namespace",
    };
    format!("{}\n{what}: {}", item.name, texts::facts(shown))
}
