//! Refuses options without effect on the requested inputs and outputs, with a hint.

use std::collections::BTreeSet;

use clap::ArgMatches;
use clap::parser::ValueSource;

use super::args::render::RenderArgs;
use crate::base::error::{Error, Result};
use crate::export::{OneDrawing, Output};
use crate::graph::window::Length;
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
    fn refuse(&self, options: &str, what: &str, hint: &str) -> Result<()> {
        match self.any(options) {
            None => Ok(()),
            Some(option) => Err(Error::usage(format!("`--{option}` {what}"), hint)),
        }
    }

    /// The first of `options` (separated by blanks) that was given.
    fn any<'a>(&self, options: &'a str) -> Option<&'a str> {
        options.split(' ').find(|name| self.0.contains(*name))
    }
}

/// A rule for options that only apply to some outputs.
struct AppliesTo {
    options: &'static str,
    /// Whether they apply to this output.
    takes: fn(&Asked<'_>, &Output) -> bool,
    /// The outputs to which they apply, for the hint.
    what: &'static str,
}

/// The rest of the command line, which decides whether an option applies to an output.
struct Asked<'a> {
    args: &'a RenderArgs,
}

impl Asked<'_> {
    /// Whether the output shows one window at a time, each with its own title.
    fn is_window(&self, output: &Output) -> bool {
        let is_one = output.target.is_numbered() || self.args.time.period == Some(Length::All);
        match output.format.word {
            "html" | "md" | "tex" => false,
            "svg" | "png" | "webp" => is_one,
            _ => is_picture(output),
        }
    }
}

/// Whether the output is drawn; a report is text around its own chart.
fn is_picture(output: &Output) -> bool {
    output.format.is_drawn && output.format.word != "md"
}

/// Whether the output contains the graph as data.
fn is_data(output: &Output) -> bool {
    ["json", "csv", "parquet"].contains(&output.format.word)
}

const RULES: &[AppliesTo] = &[
    AppliesTo {
        options: "style view for size fit expand orientation layout layout-from font",
        takes: |_, output| is_picture(output),
        what: "it applies to pictures, such as `x.gif`",
    },
    AppliesTo {
        options: "width",
        takes: |_, output| {
            is_picture(output) && output.format.word != "gif" && output.format.word != "html"
        },
        what: "it is a width on paper, for `x.pdf`, `x.svg` and `x.png`; `--size` sets that of other pictures",
    },
    AppliesTo {
        options: "title",
        takes: |_, output| output.format.is_drawn,
        what: "it applies to pictures and reports",
    },
    AppliesTo {
        options: "bare",
        takes: |asked, output| asked.is_window(output),
        what: "it applies to animations, pages and single windows: `x.gif`, `x.pdf`, `x{n}.svg`",
    },
    AppliesTo {
        options: "phases",
        takes: |_, output| {
            output.format.is_drawn || ["json", "csv", "parquet"].contains(&output.format.word)
        },
        what: "it applies to pictures, pages, reports and data: `x.gif`, `x.html`, `x.json`",
    },
    AppliesTo {
        options: "group collapse",
        takes: |_, output| !is_data(output),
        what: "data contains every element by itself; it applies to pictures and graphs, such as `x.gif`, `x.dot`",
    },
    AppliesTo {
        options: "frame-ms",
        takes: |asked, output| {
            let is_animated = output.format.word == "svg" && !asked.is_window(output);
            output.format.word == "gif" || is_animated
        },
        what: "it applies to animations: `x.gif`, `x.svg`",
    },
    AppliesTo {
        options: "strip",
        takes: |_, output| output.format.whole != OneDrawing::Never && !output.target.is_numbered(),
        what: "it applies to pictures of the whole mission: `x.svg`, `x.png`, `x.webp`, `x.pdf`",
    },
    AppliesTo {
        options: "max-bytes",
        takes: |_, output| output.format.is_limited,
        what: "it applies to `x.gif`",
    },
    AppliesTo {
        options: "link",
        takes: |_, output| output.format.word == "md",
        what: "it applies to reports: `x.md`",
    },
];

/// Options that ask for windows one after the other.
const OF_FILMS: &str = "period step align cut frame-ms max-bytes strip phases format";

/// Whether a mission without changes may become a single picture: no output is given, or it is a single picture, and no
/// option requires an animation.
pub(super) fn allows_still(given: &Given, outputs: &[Output]) -> bool {
    let is_whole = |o: &Output| o.format.whole != OneDrawing::Never && !o.target.is_numbered();
    let is_left = given.any("outputs").is_none();
    given.any(OF_FILMS).is_none() && (is_left || outputs.iter().all(is_whole))
}

/// Refuses options that apply to none of the outputs.
pub(super) fn check_outputs(given: &Given, args: &RenderArgs, outputs: &[Output]) -> Result<()> {
    let asked = Asked { args };
    for rule in RULES {
        if !outputs.iter().any(|output| (rule.takes)(&asked, output)) {
            let names = outputs.iter();
            let names = names.map(|o| format!("`{}`", o.target.path().display()));
            let names = names.collect::<Vec<_>>().join(", ");
            given.refuse(
                rule.options,
                &format!("has no effect on {names}"),
                rule.what,
            )?;
        }
    }
    Ok(())
}

/// Refuses outputs that cannot contain a figure.
pub(super) fn check_figure(outputs: &[Output]) -> Result<()> {
    let holds = |o: &Output| {
        let is_one = o.format.whole != OneDrawing::Never && !o.target.is_numbered();
        is_one || o.format.word == "tex"
    };
    match outputs.iter().find(|output| !holds(output)) {
        None => Ok(()),
        Some(output) => Err(Error::usage(
            format!(
                "`{}` cannot contain a figure",
                output.target.path().display()
            ),
            "figures are `.pdf`, `.svg`, `.png` or `.webp`, and `.tex` to include them; `bagreel render` writes the rest",
        )),
    }
}

/// Options for how bags are read and windows cut: a mission's JSON contains windows already.
const OF_BAGS: &str =
    "offset ns verify period step start end align cut grace topology source infer";

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

/// Refuses options of `diff` that do not apply if one of the two is an expectation.
pub(super) fn check_against(given: &Given) -> Result<()> {
    given.refuse(
        "style size rate-change",
        "has no effect when a mission is compared with an expectations file",
        "give two missions, or omit it",
    )
}

/// Refuses options of `diff` that only affect pictures, if there is none.
pub(super) fn check_diff(given: &Given, infer: &[String], has_picture: bool) -> Result<()> {
    check_guesses(infer)?;
    if has_picture {
        return Ok(());
    }
    given.refuse(
        "style size",
        "has no effect without a picture",
        "it applies to pictures: `-o d.svg`, `-o d.html`",
    )?;
    given.refuse(
        "source infer",
        "has no effect without a picture: only measured and stated elements are compared",
        "add a picture: `-o d.svg`",
    )
}

/// Refuses options of `baseline` that add elements it never writes.
pub(super) fn check_baseline(given: &Given) -> Result<()> {
    given.refuse(
        "source infer",
        "has no effect on a baseline, which contains what was measured or stated",
        "use it with `check`, which accepts weaker evidence",
    )
}

/// Refuses options of `check` that apply to none of these formats.
pub(super) fn check_check(given: &Given, infer: &[String], formats: &[&str]) -> Result<()> {
    check_guesses(infer)?;
    if formats.contains(&"markdown") {
        return Ok(());
    }
    given.refuse(
        "link",
        "has no effect on these formats",
        "it applies to Markdown: `--format markdown`, `-o check.md`",
    )
}

/// Refuses to check against inferred nodes.
fn check_guesses(infer: &[String]) -> Result<()> {
    if infer.iter().any(|word| word == "source") {
        let what =
            "`--infer source` adds nodes that the bag does not name, which are never checked";
        return Err(Error::usage(
            what,
            "`render` draws them; `--source DIR` alone adds what is certain",
        ));
    }
    Ok(())
}
