//! Refuses options without effect on the requested inputs and outputs, with a hint.

use std::collections::BTreeSet;

use clap::ArgMatches;
use clap::parser::ValueSource;

use super::args::Inference;
use crate::base::error::{Error, Result};
use crate::base::words;
use crate::export::{OneDrawing, Output};
use crate::pipeline::{Reading, mission_file};

/// The names of the given options, without defaults: `style`, `layout-from`.
pub(super) struct Given(BTreeSet<String>);

impl Given {
    /// The given options of the command.
    pub(super) fn of(matches: &ArgMatches) -> Self {
        let typed = matches.subcommand().map(|(_, typed)| typed);
        let is_given =
            |typed: &ArgMatches, id: &str| typed.value_source(id) == Some(ValueSource::CommandLine);
        let names = typed.into_iter().flat_map(|typed| {
            let ids = typed.ids().filter(|id| is_given(typed, id.as_str()));
            ids.map(|id| id.as_str().replace('_', "-"))
        });
        Self(names.collect())
    }

    /// Refuses these options for the reason `what`.
    pub(super) fn refuse(&self, options: &str, what: &str, hint: &str) -> Result<()> {
        match self.any(options) {
            None => Ok(()),
            Some(option) => Err(Error::usage(format!("`--{option}` {what}"), hint)),
        }
    }

    /// The first of `options` (separated by blanks) that was given.
    pub(super) fn any<'a>(&self, options: &'a str) -> Option<&'a str> {
        options.split(' ').find(|name| self.0.contains(*name))
    }
}

/// Options that only apply to outputs whose format takes them, and to which those are, for the hint.
const RULES: [(&str, &str); 10] = [
    (
        "style for size fit orientation layout layout-from font",
        "it applies to pictures, such as `x.gif`",
    ),
    (
        "width",
        "it is a width on paper, for `x.pdf`, `x.svg` and `x.png`; `--size` sets that of other pictures",
    ),
    ("title", "it applies to pictures and reports"),
    (
        "bare",
        "it applies to animations, pages and single windows: `x.gif`, `x.pdf`, `x{n}.svg`",
    ),
    (
        "phases",
        "it applies to pictures, pages, reports and data: `x.gif`, `x.html`, `x.json`",
    ),
    (
        "group collapse",
        "data contains every element by itself; it applies to pictures and graphs, such as `x.gif`, `x.dot`",
    ),
    ("frame-ms", "it applies to animations: `x.gif`, `x.svg`"),
    (
        "strip",
        "it applies to pictures of the whole mission: `x.svg`, `x.png`, `x.webp`, `x.pdf`",
    ),
    ("max-bytes", "it applies to `x.gif`"),
    ("link", "it applies to reports: `x.md`"),
];

/// Options that ask for windows one after the other.
const OF_FILMS: &str = "period step align cut frame-ms max-bytes strip phases format";

/// Options of a graph, which a timeline of topics has not.
pub(super) const OF_GRAPHS: &str =
    "hide group collapse rqt-defaults orientation layout layout-from strip";

/// Whether an output can be one drawing of the whole mission.
fn is_whole(output: &Output) -> bool {
    output.format.whole != OneDrawing::Never && !output.target.is_numbered()
}

/// Whether a mission without changes may become a single picture: no output is given, or it is a single picture, and no
/// option requires an animation.
pub(super) fn allows_still(given: &Given, outputs: &[Output]) -> bool {
    let is_left = given.any("outputs").is_none();
    given.any(OF_FILMS).is_none() && (is_left || outputs.iter().all(is_whole))
}

/// Refuses options that apply to none of the outputs.
pub(super) fn check_outputs(given: &Given, is_one_window: bool, outputs: &[Output]) -> Result<()> {
    let applies = |option: &str| {
        let takes = |o: &Output| {
            let is_alone = o.target.is_numbered() || is_one_window;
            o.format.takes(option, is_alone)
        };
        outputs.iter().any(takes)
    };
    let names = outputs.iter();
    let names = names.map(|o| format!("`{}`", o.target.path().display()));
    let what = format!("has no effect on {}", words::joined(names, ", "));
    for (options, hint) in RULES {
        for option in options.split(' ').filter(|option| !applies(option)) {
            given.refuse(option, &what, hint)?;
        }
    }
    Ok(())
}

/// Refuses options of a graph for a timeline of topics, and that for outputs that are no pictures.
pub(super) fn check_topics(given: &Given, outputs: &[Output]) -> Result<()> {
    let mut formats = outputs.iter().map(|output| output.format);
    if !formats.any(|format| format.takes("style", false)) {
        return given.refuse(
            "mode",
            "`topics` is a picture, and no output is one",
            "write a picture, such as `x.png`",
        );
    }
    given.refuse(
        OF_GRAPHS,
        "has no effect on a timeline of topics",
        "omit it, or use `--mode all`",
    )
}

/// Options for how bags are read and windows cut: a mission's JSON contains windows already.
const OF_BAGS: &str = "offset ns verify period step start end align cut topology source infer";

/// Refuses options about bags if the input is a mission's JSON.
pub(super) fn check_inputs(given: &Given, reading: &Reading) -> Result<()> {
    if given.any(OF_BAGS).is_some()
        && let Some(path) = mission_file(&reading.inputs)?
    {
        let path = path.display();
        let what = format!("applies to bags, but `{path}` is a mission's JSON");
        return given.refuse(OF_BAGS, &what, "give the bag itself");
    }
    Ok(())
}

/// Refuses to check against inferred nodes.
pub(super) fn check_guesses(infer: &[Inference]) -> Result<()> {
    if infer.contains(&Inference::Source) {
        let what =
            "`--infer source` adds nodes that the bag does not name, which are never checked";
        return Err(Error::usage(
            what,
            "`render` draws them; `--source DIR` alone adds what is certain",
        ));
    }
    Ok(())
}
