//! The arrangement of help: the headings of `--help`, and the options and examples of `-h`, which fits one
//! screen.

use clap::{Command, CommandFactory as _};

use super::Typed;

/// The headings of `--help`, in their order, and the options under each, in every command.
const HEADINGS: [(&str, &str); 7] = [
    ("Input", "ns verify msg_path expect only update"),
    (
        "Time",
        "offset period step start end align cut rate_change phases idle",
    ),
    (
        "Filter",
        "mode ns_filter topic_filter hide group collapse rqt_defaults all",
    ),
    (
        "Picture",
        "kind style size for width fit orientation layout layout_from title rows steps text bare font",
    ),
    (
        "Output",
        "outputs output format frame_ms strip max_bytes link fields parts undecidable explain",
    ),
    ("Evidence", "topology source infer why"),
    ("Performance", "skip_existing"),
];

/// What `-h` shows of each command: its most important options, and below them three examples.
const SCREENS: &str = include_str!("screens.txt");

/// The most important options of a command, and its examples with a line end before each.
fn screen(command: &str) -> (&'static str, &'static str) {
    let screens = SCREENS.trim_end().split("\n\n");
    let mut screens = screens.filter_map(|screen| screen.split_once(':'));
    let found = screens.find(|(name, _)| *name == command);
    let (options, examples) = found.map_or(("", ""), |(_, rest)| {
        rest.split_at(rest.find('\n').unwrap_or(rest.len()))
    });
    (options.trim(), examples)
}

impl Typed {
    /// The command line's grammar with its complete help; `-h` of a command fits one screen.
    pub(super) fn grammar() -> Command {
        let hide = |arg: clap::Arg| arg.hide_short_help(true);
        let command = Self::documented().mut_arg("verbose", hide);
        let command = command.mut_arg("color", hide);
        command.mut_subcommands(|command| {
            let (essential, _) = screen(command.get_name());
            command.mut_args(|arg| {
                let is_essential = essential.split(' ').any(|id| arg.get_id() == id);
                let is_hidden = !is_essential && !arg.is_positional();
                arg.hide_short_help(is_hidden)
            })
        })
    }

    /// The command line's grammar, in which no option is left out of short help.
    pub(super) fn documented() -> Command {
        let command = examples(Self::command(), screen("bagreel").1);
        command.mut_subcommands(|command| {
            let (_, text) = screen(command.get_name());
            let command = examples(command, text);
            command.mut_args(|arg| {
                let id = arg.get_id().to_string();
                let has = |ids: &str| ids.split(' ').any(|known| known == id);
                let heading = HEADINGS.iter().find(|(_, ids)| has(ids));
                let mut names = arg.get_value_names().into_iter().flatten();
                let lists_values = names.any(|name| name.contains(['|', ',']));
                let arg = arg.hide_possible_values(lists_values);
                match heading {
                    Some((heading, _)) if !arg.is_positional() => arg.help_heading(*heading),
                    _ => arg,
                }
            })
        })
    }
}

/// `command` with `text` as its examples, before the notes that long help ends with.
fn examples(command: Command, text: &str) -> Command {
    let examples = format!("Examples:{text}");
    let more = command.get_after_long_help().or(command.get_after_help());
    // With its escape sequences: one of them keeps `{n}` as it is.
    let long = match more {
        Some(more) => format!("{examples}\n\n{}", more.ansi()),
        None => examples.clone(),
    };
    command.after_help(examples).after_long_help(long)
}
