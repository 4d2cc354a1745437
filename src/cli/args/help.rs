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

/// What `-h` shows of each command: its most important options, and three examples.
const SCREENS: [(&str, &str, &str); 13] = [
    (
        "render",
        "outputs period start end mode ns_filter topic_filter style size for",
        "
  bagreel render run.bag                              an animation of the mission, out/run.gif
  bagreel render run/ -o run.html --period 10         a page to step through, ten seconds per window
  bagreel render run.mcap --for readme -o run.gif     wide and legible enough for a README",
    ),
    (
        "figure",
        "outputs kind width rows text phases start end ns_filter topic_filter",
        "
  bagreel figure run.bag -o lives.pdf                 lifelines, as wide as a column
  bagreel figure run.bag --kind graph -o graph.pdf -o graph.tex   publishers and subscribers, with LaTeX
  bagreel figure run.bag --kind steps --steps 3,5 -o steps.pdf   how phases 3 and 5 begin",
    ),
    (
        "info",
        "format why topology source infer",
        "
  bagreel info run.bag                                contents, evidence and limits of a bag
  bagreel info bags/ --format csv                     one row per bag in a folder
  bagreel info run.bag --why /robot1/planner /robot1/plan   the evidence for an edge",
    ),
    (
        "extract",
        "output format fields msg_path topic_filter start end",
        "
  bagreel extract run.bag -o messages.csv             one row per message
  bagreel extract run.mcap --fields -o fields/        one table per topic, one column per field
  bagreel extract run.bag --topic-filter '/robot1/.*' --start 60 -o part.csv   some topics, from 1:00",
    ),
    (
        "tables",
        "output format period skip_existing",
        "
  bagreel tables bags/ -o counts/                     all bags of a folder
  bagreel tables bags/ -o counts/ --skip-existing     again, for new bags only
  bagreel tables good.bag run.bag -o counts/ --period 60   two bags, a minute per window",
    ),
    (
        "events",
        "format parts all phases start end rate_change",
        "
  bagreel events run.bag                              one line per event
  bagreel events run.bag --parts --end 1:00           the first minute, with affected topics
  bagreel events run.bag --format csv                 for a spreadsheet",
    ),
    (
        "diff",
        "format outputs rate_change start end",
        "
  bagreel diff good.bag run.bag                       what differs, as text
  bagreel diff good.bag run.bag --format markdown     for a pull request
  bagreel diff good.bag run.bag -o diff.gif           both missions in one picture",
    ),
    (
        "baseline",
        "output update only period start end",
        "
  bagreel baseline good.bag -o expect.yaml            from one healthy run
  bagreel baseline good.bag run.bag -o expect.yaml    from several: what they have in common
  bagreel baseline run.bag --update expect.yaml       after a planned change",
    ),
    (
        "check",
        "expect format outputs undecidable explain start end",
        "
  bagreel check run.bag --expect expect.yaml          print findings; the exit code is 1 if a rule is broken
  bagreel check run.bag --expect expect.yaml -o check.xml   also write a JUnit report
  bagreel check --explain topic-rate-low              explain a kind of finding",
    ),
    (
        "follow",
        "format expect outputs period idle",
        "
  bagreel follow run.bag.active                       print events while rosbag records
  bagreel follow bags/ --expect expect.yaml -o run.html     check the newest recording in a folder
  bagreel follow run/ --format ndjson                 a rosbag2 folder, events for programs",
    ),
    (
        "styles",
        "",
        "
  bagreel styles                                      list the built-in styles
  bagreel styles light > own.toml                     begin a style of your own
  bagreel render run.bag --style dark                 use a style",
    ),
    (
        "completions",
        "",
        "
  bagreel completions bash > ~/.local/share/bash-completion/completions/bagreel
  bagreel completions zsh > ~/.zfunc/_bagreel
  bagreel completions fish > ~/.config/fish/completions/bagreel.fish",
    ),
    (
        "man",
        "",
        "
  bagreel man | man -l -                              the page of all commands
  bagreel man render | man -l -                       the page of one command
  bagreel man check > bagreel-check.1                 a file to install",
    ),
];

/// The examples of `bagreel -h`.
const FIRST: &str = "
  bagreel render run.bag                              an animation of the mission, out/run.gif
  bagreel info run.bag                                contents, evidence and limits of a bag
  bagreel events run.bag                              what started, stopped or changed, and when";

impl Typed {
    /// The command line's grammar with its complete help; `-h` of a command fits one screen.
    pub(crate) fn grammar() -> Command {
        let hide = |arg: clap::Arg| arg.hide_short_help(true);
        let command = Self::documented().mut_arg("verbose", hide);
        let command = command.mut_arg("color", hide);
        command.mut_subcommands(|command| {
            let known = SCREENS.iter().find(|known| known.0 == command.get_name());
            let essential = known.map_or("", |known| known.1);
            command.mut_args(|arg| {
                let is_essential = essential.split(' ').any(|id| arg.get_id() == id);
                let is_hidden = !is_essential && !arg.is_positional();
                arg.hide_short_help(is_hidden)
            })
        })
    }

    /// The command line's grammar, in which no option is left out of short help.
    pub(crate) fn documented() -> Command {
        let command = examples(Self::command(), FIRST);
        command.mut_subcommands(|command| {
            let known = SCREENS.iter().find(|known| known.0 == command.get_name());
            let command = examples(command, known.map_or("", |known| known.2));
            command.mut_args(|arg| {
                let id = arg.get_id().to_string();
                let has = |ids: &str| ids.split(' ').any(|known| known == id);
                let heading = HEADINGS.iter().find(|(_, ids)| has(ids));
                let lists_values = arg
                    .get_value_names()
                    .is_some_and(|names| names.iter().any(|name| name.contains(['|', ','])));
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
    let long = more.map_or_else(
        || examples.clone(),
        |more| format!("{examples}\n\n{}", more.ansi()),
    );
    command.after_help(examples).after_long_help(long)
}
