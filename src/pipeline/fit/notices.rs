//! The notices about what `--fit auto` did.

use std::sync::Arc;

use crate::base::name::lies_in;
use crate::base::notice::{Notice, NoticeKind, Notices};
use crate::base::words;
use crate::draw::picture::PageOptions;
use crate::pipeline::Drawing;

/// The collapsed namespaces as text, each with the number of changing elements kept outside.
pub(super) fn parts(collapsed: &[Arc<str>], kept: &[Arc<str>]) -> Vec<(Arc<str>, String)> {
    let reported = |name: &Arc<str>| {
        let inside = |other: &&Arc<str>| lies_in(other, name);
        let words = match kept.iter().filter(inside).count() {
            0 => name.to_string(),
            many => format!("{name} except {} in it", words::count(many, "node")),
        };
        (Arc::clone(name), words)
    };
    collapsed.iter().map(reported).collect()
}

/// The notices about what `--fit auto` did, and whether it was sufficient: the smallest text is `text` pixels high.
pub(super) fn reported(
    drawing: &Drawing,
    collapsed: &[(Arc<str>, String)],
    got: &PageOptions,
    text: f64,
) -> Notices {
    let mut notices = Notices::new();
    let is_readable = text >= drawing.readable();
    if drawing.page.size != got.size && drawing.medium.is_none() {
        let text = format!(
            "the page is {}x{}{} (change with `--size`)",
            got.size.w,
            got.size.h,
            so_that(is_readable)
        );
        notices.add(Notice::new(NoticeKind::Chosen, text));
    }
    if let Some((first, _)) = collapsed.first() {
        let collapsed: Vec<&String> = collapsed.iter().map(|(_, words)| words).collect();
        let text = format!(
            "drew namespaces as one box each{}: {}; keep one open with `--collapse -{first}`, all with `--fit none`",
            so_that(is_readable),
            words::some_of(&collapsed, 3)
        );
        notices.add(Notice::new(NoticeKind::Hidden, text));
    }
    if let Some(medium) = drawing.medium.as_ref().filter(|_| !is_readable) {
        let size = match got.width_mm {
            Some(mm) => {
                let pt = text * mm / got.size.w * 72.0 / 25.4;
                format!("{} pt", words::number(words::significant(pt, 2)))
            }
            None => format!("{} pixels", words::number(words::significant(text, 2))),
        };
        let advice = medium.advice();
        let text = format!("the smallest text will be {size}, too small to read; {advice}");
        notices.add(Notice::new(NoticeKind::Note, text));
    } else if !is_readable {
        let text = format!(
            "the smallest text is {} pixels high, too small to read; use `--ns-filter`, `--hide dead,leaf`, `--mode nodes` or a larger `--size`",
            words::number(text)
        );
        notices.add(Notice::new(NoticeKind::Note, text));
    }
    notices
}

pub(super) fn so_that(is_readable: bool) -> &'static str {
    if is_readable {
        " to keep labels legible"
    } else {
        ""
    }
}
