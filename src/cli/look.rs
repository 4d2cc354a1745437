//! The options for the look of pictures, from the command line.

use std::path::{Path, PathBuf};

use super::applies::{Given, OF_GRAPHS};
use super::render::{LookArgs, ModeWord, SequenceArgs, ViewArgs};
use crate::base::error::{Error, Result};
use crate::base::geometry::Size;
use crate::base::{budget, file};
use crate::draw::picture::PageOptions;
use crate::draw::style::{BUILTIN, Style};
use crate::draw::text::Fonts;
use crate::export::options::{self, SequenceOptions};
use crate::mission::{Places, read_json};
use crate::pipeline::Body;
use crate::view::{Grouping, Hide, Mode, NameFilter, ViewOptions};

/// The view options: `rqt_graph`'s defaults or ours, modified by the given options.
pub(super) fn view(args: &ViewArgs) -> Result<ViewOptions> {
    let mut view = if args.rqt_defaults {
        ViewOptions::rqt_defaults()
    } else {
        ViewOptions::default()
    };
    match args.mode {
        Some(ModeWord::Nodes) => view.mode = Mode::Nodes,
        Some(ModeWord::All) => view.mode = Mode::All,
        Some(ModeWord::Topics) | None => {}
    }
    if let Some(filter) = &args.ns_filter {
        view.ns_filter = NameFilter::parse(filter)?;
    }
    if let Some(filter) = &args.topic_filter {
        view.topic_filter = NameFilter::parse(filter)?;
    }
    if let Some(hide) = &args.hide {
        view.hide = Hide::parse(hide)?;
    }
    if let Some(group) = &args.group {
        view.group = Grouping::parse(group)?;
    }
    for name in &args.collapse {
        match name.strip_prefix('-') {
            Some(kept) => view.expand.push(kept.into()),
            None => view.collapse.push(name.as_str().into()),
        }
    }
    Ok(view)
}

/// Graph or timeline: as requested, or a graph if an option only applies to a graph.
pub(super) fn body(mode: Option<ModeWord>, given: &Given) -> Body {
    match mode {
        Some(ModeWord::Topics) => Body::TopicTimeline,
        None if given.any(OF_GRAPHS).is_none() => Body::Auto,
        _ => Body::Graph,
    }
}

/// A built-in style by its name, else a file.
pub(super) fn style(name: &str) -> Result<Style> {
    let path = Path::new(name);
    if BUILTIN.iter().any(|row| row.0 == name) || !path.exists() {
        return Style::builtin(name);
    }
    let text = file::read_text(path, budget::USER_TEXT)?;
    Style::from_toml(&text, path)
}

/// The bundled font, with the user's font file for characters that it lacks.
pub(super) fn fonts(file: Option<&Path>) -> Result<Fonts> {
    let Some(path) = file else {
        return Ok(Fonts::bundled());
    };
    let data = file::read(path, budget::FONT)?;
    Fonts::bundled().with(data, path)
}

pub(super) fn page(args: &LookArgs, rate_change: f64) -> PageOptions {
    let default = PageOptions::default();
    let size = args.size.map(|(w, h)| Size::new(w.into(), h.into()));
    PageOptions {
        size: size.unwrap_or(default.size),
        width_mm: args.width,
        bare: args.bare,
        title: args.title.clone(),
        orientation: args.orientation,
        rate_change,
        ..default
    }
}

pub(super) fn sequence(args: &SequenceArgs) -> Result<SequenceOptions> {
    let strip = args.strip.as_deref().map(options::Choice::parse);
    Ok(SequenceOptions {
        frame_ms: args.frame_ms,
        max_bytes: args.max_bytes,
        strip: strip.transpose()?,
        links: args.link.clone(),
        append_to: summary(),
        ..SequenceOptions::default()
    })
}

/// The summary file of a GitHub job; its name has no extension.
pub(super) fn summary() -> Option<PathBuf> {
    std::env::var_os("GITHUB_STEP_SUMMARY").map(PathBuf::from)
}

/// The positions from an earlier run's JSON.
pub(super) fn kept(file: Option<&Path>) -> Result<Option<Places>> {
    let Some(path) = file else { return Ok(None) };
    let text = file::read_text(path, budget::MISSION_JSON)?;
    let places = read_json(&text, path)?.layout;
    places.map(Some).ok_or_else(|| {
        let hint = "write it beside a picture: `bagreel render BAG -o x.gif -o x.json`";
        Error::bad_file(path, 0, "it contains no layout", hint)
    })
}
