//! The functions exported to Python; slow work runs without the interpreter's lock.

mod arrow;
mod table;

use std::collections::BTreeMap;
use std::ffi::{CString, OsString};

use bagreel::bag::Input;
use bagreel::commands::{Counting, LogFormat, LogOptions, log};
use bagreel::internals::tables::{count, of_mission};
use bagreel::values::{Align, Length, Period};
use bagreel::{Error, Mission as Read, Reading};
use pyo3::exceptions::{PyRuntimeError, PyUserWarning, PyValueError};
use pyo3::prelude::*;
use pyo3::types::PyDict;

use table::Table;

pyo3::create_exception!(
    _bagreel,
    BagreelError,
    PyRuntimeError,
    "A bag could not be read, or a table could not be created."
);

/// The error as a Python exception, followed by its hint.
fn raised(error: &Error) -> PyErr {
    let hint = error.hint();
    let text = match hint.is_empty() {
        true => error.to_string(),
        false => format!("{error} ({hint})"),
    };
    match error.is_usage() {
        true => PyValueError::new_err(text),
        false => BagreelError::new_err(text),
    }
}

fn period(text: &str) -> PyResult<Period> {
    let bad = || {
        PyValueError::new_err(format!(
            "period={text:?} is no length of time: give `60`, `30s`, `1m` or `500ms`"
        ))
    };
    Period::parse(text).ok_or_else(bad)
}

fn align(text: &str) -> PyResult<Align> {
    match text {
        "clock" => Ok(Align::Clock),
        "bag" => Ok(Align::Bag),
        _ => Err(PyValueError::new_err(format!(
            "align={text:?} is neither `clock` nor `bag`"
        ))),
    }
}

/// A row per publisher, topic and window with messages of one recording, which may have several parts.
#[pyfunction]
#[pyo3(signature = (uris, *, period="10s", align="clock"))]
fn tables(py: Python<'_>, uris: Vec<String>, period: &str, align: &str) -> PyResult<Table> {
    let counting = Counting {
        period: self::period(period)?,
        align: self::align(align)?,
    };
    let inputs: Vec<Input> = uris.iter().map(Input::parse).collect();
    let name = uris.first().map_or("", String::as_str);
    let counts = py.detach(|| count(name, &inputs, &counting));
    let counts = counts.map_err(|e| raised(&e))?;
    for notice in counts.notices.iter().filter(|notice| notice.kind.is_loss()) {
        let text = format!("{name}: {}", notice.text).replace('\0', "\\0");
        let category = py.get_type::<PyUserWarning>();
        // The warning belongs to the caller of the function in Python.
        PyErr::warn(py, &category, &CString::new(text)?, 2)?;
    }
    Table::new(counts.rows)
}

/// Reads bags, or a mission's JSON, as one mission.
#[pyfunction]
#[pyo3(signature = (uris, *, period=None, align="bag"))]
fn read(py: Python<'_>, uris: Vec<String>, period: Option<&str>, align: &str) -> PyResult<Mission> {
    let mut reading = Reading::of(uris);
    reading.division.length = match period {
        None => Length::Auto,
        Some("all") => Length::All,
        Some(text) => Length::Fixed(self::period(text)?),
    };
    reading.division.align = self::align(align)?;
    let mission = py.detach(|| bagreel::read(&reading));
    mission.map(Mission).map_err(|e| raised(&e))
}

/// Runs the command with these arguments, the program's name first; returns its exit code.
#[pyfunction]
fn main(py: Python<'_>, args: Vec<OsString>) -> u8 {
    py.detach(|| bagreel::run_command(args))
}

/// A mission: its windows with their graphs and changes.
#[pyclass(frozen, module = "bagreel")]
struct Mission(Read);

#[pymethods]
impl Mission {
    /// Its tables by name: `edges`, `topics`, `nodes`, `changes`, `events`, `phases`, `bags`.
    fn tables(&self, py: Python<'_>) -> PyResult<BTreeMap<&'static str, Table>> {
        let tables = py.detach(|| of_mission(&self.0)).into_iter();
        tables
            .map(|(word, batch)| Ok((word, Table::new(batch)?)))
            .collect()
    }

    /// The mission as JSON, equal to the output of `render -o x.json`.
    fn to_json(&self, py: Python<'_>) -> PyResult<String> {
        let mut text = Vec::new();
        py.detach(|| bagreel::write_json(&self.0, &mut text))
            .map_err(|e| BagreelError::new_err(e.to_string()))?;
        String::from_utf8(text).map_err(|e| BagreelError::new_err(e.to_string()))
    }

    /// The names of its nodes, sorted.
    #[getter]
    fn nodes(&self) -> Vec<&str> {
        self.0
            .elements
            .nodes
            .iter()
            .map(|n| n.name.as_str())
            .collect()
    }

    /// The names of its topics, sorted.
    #[getter]
    fn topics(&self) -> Vec<&str> {
        self.0
            .elements
            .topics
            .iter()
            .map(|t| t.name.as_str())
            .collect()
    }

    /// The event log, in order of time, as printed by `bagreel events --format ndjson`.
    #[getter]
    fn events<'py>(&self, py: Python<'py>) -> PyResult<Vec<Bound<'py, PyAny>>> {
        let text = py.detach(|| log(&self.0, LogFormat::Ndjson, LogOptions::default()));
        let json = py.import("json")?;
        let lines = text.lines().map(|line| json.call_method1("loads", (line,)));
        lines.collect()
    }

    /// Its windows, a dict each: `index`, `start_ns`, `end_ns`, `partial`, `messages`, `changes`.
    #[getter]
    fn windows<'py>(&self, py: Python<'py>) -> PyResult<Vec<Bound<'py, PyDict>>> {
        let windows = self.0.windows.iter().map(|window| {
            let row = PyDict::new(py);
            row.set_item("index", window.index)?;
            row.set_item("start_ns", window.span.start.0)?;
            row.set_item("end_ns", window.span.end.0)?;
            row.set_item("partial", window.partial)?;
            row.set_item("messages", window.messages)?;
            row.set_item("changes", window.changes.len())?;
            Ok(row)
        });
        windows.collect()
    }

    /// From its first message to its last, in seconds.
    #[getter]
    fn duration(&self) -> f64 {
        self.0.span.nanos() as f64 / 1e9
    }

    /// The number of its messages.
    #[getter]
    fn messages(&self) -> u64 {
        self.0.messages
    }

    /// The names of its bags.
    #[getter]
    fn bags(&self) -> Vec<&str> {
        self.0.bags.iter().map(|bag| bag.name.as_str()).collect()
    }

    fn _repr_html_<'py>(slf: &Bound<'py, Self>) -> PyResult<Bound<'py, PyAny>> {
        slf.py()
            .import("bagreel._summary")?
            .call_method1("html", (slf,))
    }

    /// The number of windows.
    fn __len__(&self) -> usize {
        self.0.windows.len()
    }

    fn __repr__(&self) -> String {
        // As many as `events` has.
        let events = log(&self.0, LogFormat::Ndjson, LogOptions::default());
        let (windows, changes) = (self.0.windows.len(), events.lines().count());
        format!("<bagreel.Mission: {windows} windows, {changes} changes>")
    }
}

/// The native part of the package `bagreel`.
#[pymodule]
mod _bagreel {
    #[pymodule_export]
    #[expect(non_upper_case_globals, reason = "its name in Python")]
    const __version__: &str = env!("CARGO_PKG_VERSION");
    #[pymodule_export]
    use super::{BagreelError, Mission, Table, main, read, tables};
}
