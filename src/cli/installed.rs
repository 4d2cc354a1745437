//! What comes with the command: styles, completions and manual pages.

use std::path::Path;

use crate::base::error::{Error, Result};
use crate::base::nearest::suggestion;
use crate::base::words;
use crate::cli::DONE;
use crate::cli::Typed;
use crate::cli::terminal::Terminal;
use crate::draw::style::{BUILTIN, builtin_text};

/// Prints the built-in style `name`, or the names of all.
pub(super) fn styles(name: Option<&str>, terminal: &mut Terminal) -> Result<u8> {
    let names = words::joined(BUILTIN.iter().map(|row| row.0), "\n");
    match name {
        Some(name) => terminal.results(builtin_text(name)?)?,
        None => terminal.results(&(names + "\n"))?,
    }
    Ok(DONE)
}

/// Prints the completions for `shell`.
pub(super) fn completions(shell: clap_complete::Shell, terminal: &mut Terminal) -> Result<u8> {
    let mut text = Vec::new();
    clap_complete::generate(shell, &mut Typed::grammar(), "bagreel", &mut text);
    terminal.results(&String::from_utf8_lossy(&text))?;
    Ok(DONE)
}

/// Prints the manual page of the command `name`, or that of all commands.
pub(super) fn manual(name: Option<&str>, terminal: &mut Terminal) -> Result<u8> {
    // The plain grammar would omit the options that short help hides. Building gives the commands their full
    // names, such as `bagreel-render`.
    let mut command = Typed::documented().disable_help_subcommand(true);
    command.build();
    if let Some(name) = name {
        command = command.find_subcommand(name).cloned().ok_or_else(|| {
            let known = || command.get_subcommands().map(clap::Command::get_name);
            let what = format!("no command `{name}`{}", suggestion(name, known()));
            Error::usage(what, format!("commands: {}", words::joined(known(), ", ")))
        })?;
    }
    let mut page = Vec::new();
    clap_mangen::Man::new(command)
        .source(concat!("bagreel ", env!("CARGO_PKG_VERSION")))
        .render(&mut page)
        .map_err(Error::io("write", Path::new("the manual page")))?;
    terminal.results(&String::from_utf8_lossy(&page))?;
    Ok(DONE)
}
