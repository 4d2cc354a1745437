//! A bundle for replication: digests and commands, a survey, how much each recording reconfigures, and figures.

use std::collections::BTreeSet;
use std::fmt::Write as _;
use std::fs;
use std::io::{Read as _, Write as _};
use std::path::{Path, PathBuf};

use super::survey::{recordings, size, surveyed};
use super::{Reading, Stage, Watch, read};
use crate::bag::Recording;
use crate::base::digest::Sum;
use crate::base::error::{Error, Result};
use crate::draw::figure::{self, FigureKind, FigureOptions};
use crate::draw::paint::pdf::{self, PdfPage};
use crate::draw::text::Fonts;
use crate::export::tables::folder::{Folder, file_stem};
use crate::export::tables::{TableFormat, writer};
use crate::mission::Mission;
use crate::mission::info::{SurveyRow, survey_table};
use crate::mission::reconfiguration::{self, Reconfiguration};
use crate::view::NameFilter;

/// The whole job of `bagreel paper`.
pub(crate) struct Paper {
    /// Recordings, and folders of recordings.
    pub(crate) runs: Vec<PathBuf>,
    /// The folder to write.
    pub(crate) folder: PathBuf,
    /// The options of reading, without inputs.
    pub(crate) reading: Reading,
    /// The options of the command as typed, for `commands.sh`.
    pub(crate) options: String,
}

/// The outcome of `bagreel paper`.
#[derive(Default)]
pub(crate) struct Papered {
    /// The number of recordings.
    pub(crate) runs: usize,
    /// The number of files written.
    pub(crate) files: usize,
    /// Figures that could not be drawn and recordings that could not be read, with the reasons.
    pub(crate) remarks: Vec<String>,
    /// Whether any data was skipped.
    pub(crate) skipped: bool,
}

/// The files that are identical in every bundle.
const README: &str = include_str!("../../docs/src/bundle.md");
const CITATION: &str = include_str!("../../CITATION.cff");

/// The widths of figures in millimetres: a column for lifelines, a page for all others.
const WIDTHS: (f64, f64) = (88.0, 181.0);

/// Reads every recording and writes the bundle, whole or not at all. The same recordings make the same bytes.
///
/// # Errors
/// If no recording is found, or the folder cannot be written.
pub(crate) fn paper(job: &Paper, watch: &mut dyn Watch) -> Result<Papered> {
    let mut done = Papered::default();
    let (mut rows, mut runs, mut sums) = (Vec::new(), Vec::new(), String::new());
    let mut bundle = Bundle {
        folder: Folder::create(&job.folder)?,
        path: &job.folder,
        names: BTreeSet::new(),
    };
    let (mut all, mut readable) = (BTreeSet::new(), Vec::new());
    for run in &job.runs {
        let below = if run.is_dir() {
            recordings(run)?
        } else {
            vec![Recording::of(run.clone())]
        };
        all.extend(below);
    }
    for run in all {
        watch.stage(Stage::Read);
        let name = run.name_in(Path::new(""));
        for path in run.paths() {
            digests(path, &mut sums)?;
        }
        let reading = Reading {
            inputs: run.inputs(),
            ..job.reading.clone()
        };
        let mission = read(&reading, watch);
        if watch.stopped() {
            return Err(Error::Interrupted);
        }
        if let Ok(mission) = &mission {
            watch.stage(Stage::Draw);
            runs.push(Reconfiguration::new(&name, mission));
            bundle.figures(&name, mission, &mut done.remarks)?;
        }
        let row: SurveyRow = surveyed(name, size(&reading.inputs), mission);
        done.skipped |= !row.is_complete;
        done.remarks.extend(row.error.clone());
        if row.error.is_none() {
            readable.push(run);
        }
        rows.push(row);
    }
    done.runs = rows.len();
    let csv = |table| writer::whole(TableFormat::Csv, &table);
    bundle.write("survey.csv", &csv(survey_table(&rows))?)?;
    for (name, table) in reconfiguration::tables(&runs) {
        bundle.write(&format!("{name}.csv"), &csv(table)?)?;
    }
    bundle.write("SHA256SUMS", sums.as_bytes())?;
    bundle.write("commands.sh", commands(job, &readable).as_bytes())?;
    bundle.write("README.md", README.as_bytes())?;
    bundle.write("CITATION.cff", CITATION.as_bytes())?;
    done.files = bundle.names.len();
    bundle.folder.commit()?;
    Ok(done)
}

/// Adds the digests of the files of a recording, as `sha256sum` writes them.
fn digests(run: &Path, sums: &mut String) -> Result<()> {
    let mut files = vec![run.to_owned()];
    if run.is_dir() {
        let entries = fs::read_dir(run).map_err(Error::io("read", run))?;
        files = entries
            .filter_map(|entry| Some(entry.ok()?.path()))
            .collect();
        files.retain(|path| path.is_file());
        files.sort();
    }
    for path in files {
        let failed = |error| Error::io("read", &path)(error);
        let mut file = fs::File::open(&path).map_err(failed)?;
        let mut sum = Sum::default();
        let mut block = vec![0; 1 << 20];
        loop {
            match file.read(&mut block).map_err(failed)? {
                0 => break,
                many => sum.add(&block[..many]),
            }
        }
        // Writing to a string cannot fail.
        let _ = writeln!(sums, "{}  {}", sum.hex(64), path.display());
    }
    Ok(())
}

/// The commands that make the bundle, and each of its parts again.
fn commands(job: &Paper, readable: &[Recording]) -> String {
    let quoted = |path: &PathBuf| {
        let path = path.display().to_string();
        format!("'{}'", path.replace('\'', r"'\''"))
    };
    let quoted = |paths: &[PathBuf]| paths.iter().map(quoted).collect::<Vec<_>>().join(" ");
    let mut text = format!(
        "#!/bin/sh\n# bagreel {}\nbagreel paper {}{} -o bundle\n",
        env!("CARGO_PKG_VERSION"),
        quoted(&job.runs),
        job.options
    );
    for run in readable {
        let run = quoted(run.paths());
        let _ = writeln!(
            text,
            "bagreel info {run} --format csv\nbagreel events {run} --format csv"
        );
    }
    text
}

/// The folder in progress.
struct Bundle<'a> {
    folder: Folder,
    path: &'a Path,
    names: BTreeSet<String>,
}

impl Bundle<'_> {
    fn write(&mut self, name: &str, bytes: &[u8]) -> Result<()> {
        self.names.insert(name.to_owned());
        let mut part = self.folder.file(name.to_owned());
        part.write_all(bytes)
            .map_err(Error::io("write", &self.path.join(name)))
    }

    /// A name for the figures of a recording: that of its file, with a number if it is already in use.
    fn stem(&self, run: &str) -> String {
        let name = Path::new(run).file_stem().unwrap_or_default();
        let name = file_stem(&name.to_string_lossy()).replace('%', "_");
        let is_free = |stem: &String| {
            let stem = format!("{stem}.");
            !self.names.iter().any(|name| name.starts_with(&stem))
        };
        let numbered = (2..).map(|number| format!("{name}-{number}"));
        let mut stems = std::iter::once(name.clone()).chain(numbered);
        stems.find(is_free).unwrap_or_default()
    }

    /// Writes the figures that fit a recording; those that do not are remarks.
    fn figures(&mut self, run: &str, mission: &Mission, remarks: &mut Vec<String>) -> Result<()> {
        let fonts = Fonts::bundled();
        let all = NameFilter::default();
        let stem = self.stem(run);
        for fitting in crate::mission::info::figures(mission) {
            let kind = FigureKind::parse(fitting.figure)?;
            let width_mm = if kind == FigureKind::Lives {
                WIDTHS.0
            } else {
                WIDTHS.1
            };
            let options = FigureOptions {
                kind,
                width_mm,
                ..FigureOptions::default()
            };
            let name = format!("{stem}.{}.pdf", kind.word());
            let drawn = match figure::figure(mission, (&all, &all), &fonts, &options) {
                Ok(drawn) => drawn,
                Err(error) => {
                    remarks.push(format!("no figure `{name}`: {error}"));
                    continue;
                }
            };
            let latex = figure::latex(&drawn, &name, &options);
            let page = PdfPage {
                scene: drawn.scene,
                entry: run.to_owned(),
            };
            let hint = "`bagreel figure` draws it as SVG";
            let bytes = pdf::write(std::iter::once(page), &fonts)
                .map_err(|reason| Error::output(&self.path.join(&name), reason, hint))?;
            self.write(&name, &bytes)?;
            self.write(&format!("{stem}.{}.tex", kind.word()), latex.as_bytes())?;
        }
        Ok(())
    }
}
