//! Completions and manual pages, which packages install with the command.

use std::path::Path;

use crate::base::error::Error;
use crate::base::nearest::suggestion;
use crate::cli::args::Typed;
use crate::cli::terminal::Terminal;

/// Prints the completions for `shell`.
pub(super) fn completions(
    shell: clap_complete::Shell,
    terminal: &mut Terminal,
) -> Result<(), Error> {
    let mut text = Vec::new();
    clap_complete::generate(shell, &mut Typed::grammar(), "bagreel", &mut text);
    terminal.results(&String::from_utf8_lossy(&text))
}

/// Prints the manual page of the command `name`, or that of all commands.
pub(super) fn manual(name: Option<&str>, terminal: &mut Terminal) -> Result<(), Error> {
    // The plain grammar would omit the options that short help hides. Building gives the commands their full
    // names, such as `bagreel-render`.
    let mut command = Typed::documented().disable_help_subcommand(true);
    command.build();
    if let Some(name) = name {
        command = command.find_subcommand(name).cloned().ok_or_else(|| {
            let known = command.get_subcommands().map(clap::Command::get_name);
            let known: Vec<&str> = known.collect();
            let near = suggestion(name, known.iter().copied());
            let all = known.join(", ");
            Error::usage(
                format!("no command `{name}`{near}"),
                format!("commands: {all}"),
            )
        })?;
    }
    let mut page = Vec::new();
    clap_mangen::Man::new(command)
        .source(concat!("bagreel ", env!("CARGO_PKG_VERSION")))
        .render(&mut page)
        .map_err(Error::io("write", Path::new("the manual page")))?;
    terminal.results(&String::from_utf8_lossy(&page))
}
