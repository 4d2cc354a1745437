//! The options for the look of pictures, from the command line.

use std::path::Path;
use std::sync::Arc;

use super::args::figure::FigureForm;
use super::args::render::{LookArgs, RenderArgs, SequenceArgs, ViewArgs};
use crate::base::error::{Error, Result};
use crate::base::geometry::Size;
use crate::base::{budget, file};
use crate::draw::figure::{FigureKind, RowKind};
use crate::draw::picture::PageOptions;
use crate::draw::style::{BUILTIN, Style};
use crate::draw::text::Fonts;
use crate::export::options::{self, FigureOptions};
use crate::layout::Orientation;
use crate::mission::{Places, read_json};
use crate::pipeline::{Body, Phases};
use crate::view::{Grouping, Hide, Mode, NameFilter, ViewOptions};

/// The view options: `rqt_graph`'s defaults or ours, modified by the given options.
pub(super) fn view(args: &ViewArgs) -> Result<ViewOptions> {
    let mut view = if args.rqt_defaults {
        ViewOptions::rqt_defaults()
    } else {
        ViewOptions::default()
    };
    if let Some(mode) = &args.mode {
        view.mode = Mode::parse(mode)?;
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
    let names = |names: &[String]| names.iter().map(|n| Arc::from(n.as_str())).collect();
    view.collapse = names(&args.collapse);
    view.expand = names(&args.expand);
    Ok(view)
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

/// The built-in styles, one per line.
pub(super) fn styles() -> String {
    let names: Vec<&str> = BUILTIN.iter().map(|row| row.0).collect();
    names.join("\n") + "\n"
}

/// The bundled font, with the user's font file for characters that it lacks.
pub(super) fn fonts(file: Option<&Path>) -> Result<Fonts> {
    let Some(path) = file else {
        return Ok(Fonts::bundled());
    };
    let data = file::read(path, budget::FONT)?;
    Fonts::bundled().with(data, path)
}

pub(super) fn options(args: &LookArgs, rate_change: f64) -> PageOptions {
    let default = PageOptions::default();
    let size = args
        .size
        .map_or(default.size, |(w, h)| Size::new(f64::from(w), f64::from(h)));
    PageOptions {
        size,
        width_mm: args.width,
        bare: args.bare,
        title: args.title.clone(),
        orientation: match args.orientation.as_str() {
            "LR" => Some(Orientation::LeftRight),
            "TB" => Some(Orientation::TopBottom),
            _ => None,
        },
        rate_change,
        ..default
    }
}

pub(super) fn sequence(args: &SequenceArgs) -> Result<options::SequenceOptions> {
    let strip = args.strip.as_deref().map(options::Choice::parse);
    Ok(options::SequenceOptions {
        frame_ms: args.frame_ms,
        max_bytes: args.max_bytes,
        strip: strip.transpose()?,
        links: args.link.iter().map(|l| link(l)).collect::<Result<_>>()?,
        ..options::SequenceOptions::default()
    })
}

/// Graph or board: as requested, or a graph if an option only applies to a graph.
pub(super) fn body(args: &RenderArgs) -> Result<Body> {
    let (view, look) = (&args.view, &args.look);
    let typed = [
        ("--mode", view.mode.is_some()),
        ("--hide", view.hide.is_some()),
        ("--group", view.group.is_some()),
        ("--collapse", !view.collapse.is_empty()),
        ("--expand", !view.expand.is_empty()),
        ("--rqt-defaults", view.rqt_defaults),
        ("--orientation", look.orientation != "auto"),
        ("--layout", look.layout != "layered"),
        ("--layout-from", look.layout_from.is_some()),
        ("--strip", args.sequence.strip.is_some()),
    ];
    let graph = typed.iter().find(|(_, is)| *is).map(|(flag, _)| *flag);
    match (view.view.as_deref(), graph) {
        (Some("board"), Some(flag)) => Err(Error::usage(
            format!("`{flag}` has no effect on a topic timeline"),
            "omit it, or use `--view graph`",
        )),
        (Some("board"), None) => Ok(Body::TopicTimeline),
        (None, None) => Ok(Body::Auto),
        _ => Ok(Body::Graph),
    }
}

/// The requested figure, with its width on paper in millimetres.
pub(super) fn figure(word: &str, form: &FigureForm, width: Option<f64>) -> Result<FigureOptions> {
    let kind = FigureKind::parse(word)?;
    let steps = form.steps.iter().map(|s| usize::from(*s)).collect();
    let has_steps = matches!(kind, FigureKind::Steps | FigureKind::Changes);
    if !has_steps && !form.steps.is_empty() {
        return Err(Error::usage(
            format!("`--steps` has no effect on `{word}`"),
            "it chooses the panels of `--kind steps` and `changes`",
        ));
    }
    let rows = form.rows.as_deref().map(RowKind::parse).transpose()?;
    if kind != FigureKind::Lives && rows == Some(RowKind::Topics) {
        return Err(Error::usage(
            format!("`{word}` has no rows of topics"),
            "`--rows nodes` or `--rows groups`; topics are arrows",
        ));
    }
    let default = FigureOptions::default();
    Ok(FigureOptions {
        kind,
        width_mm: width.unwrap_or(default.width_mm),
        text_pt: form.text.unwrap_or(default.text_pt),
        rows,
        steps,
        ..default
    })
}

/// The source of phases.
pub(super) fn phases(word: &str) -> Phases {
    match word {
        "auto" => Phases::Found,
        "none" => Phases::None,
        file => Phases::File(file.into()),
    }
}

fn link(text: &str) -> Result<(String, String)> {
    let parts = text
        .split_once('=')
        .filter(|(name, url)| !name.is_empty() && !url.is_empty());
    let (name, url) = parts.ok_or_else(|| {
        Error::usage(
            format!("`--link {text}` is not a name and an address"),
            "write `--link player=https://…`",
        )
    })?;
    // Readers trust the links in a report: no scheme that executes code.
    let scheme = url
        .split_once(':')
        .map(|(scheme, _)| scheme.to_ascii_lowercase());
    let is_word = |c: char| c.is_ascii_alphanumeric() || matches!(c, '+' | '-' | '.');
    let scheme = scheme.filter(|s| s.chars().all(is_word));
    if scheme.is_some_and(|s| !matches!(s.as_str(), "http" | "https")) {
        return Err(Error::usage(
            format!("`--link {text}` is not a valid address"),
            "write `--link player=https://…`, or a path",
        ));
    }
    Ok((name.to_owned(), url.to_owned()))
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
