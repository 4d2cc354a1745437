//! The research prototype's table: `Name,Publish,Subscribe,Node-start,Node-end`, lists as Python writes them, times in
//! seconds after the bag's start.

use std::path::Path;

use super::{NamedElement, Topology, TopologyEntry, place, resolved};
use crate::base::budget::TOPOLOGY_ENTRIES;
use crate::base::cast;
use crate::base::csv;
use crate::base::error::{Error, Result};

const COLUMNS: [&str; 5] = ["Name", "Publish", "Subscribe", "Node-start", "Node-end"];
const HINT: &str =
    "columns are Name,Publish,Subscribe,Node-start,Node-end; lists look like \"['/a', '/b']\"";

pub(super) fn read(path: &Path, text: &str) -> Result<Topology> {
    let wrong = |line, reason| Error::bad_file(path, line, reason, HINT);
    let mut rows = csv::each_record(text).map(|row| row.map_err(|(line, why)| wrong(line, why)));
    let (_, head) = rows.next().transpose()?.unwrap_or_default();
    let column = |name: &str| {
        head.iter()
            .position(|h| h.trim().eq_ignore_ascii_case(name))
    };
    let columns = COLUMNS.map(column);
    if columns[0].is_none() {
        return Err(wrong(1, "there is no column `Name`".to_owned()));
    }
    let mut topology = Topology::default();
    for row in rows {
        let (line, row) = row?;
        if topology.entries.len() > TOPOLOGY_ENTRIES {
            let reason = format!("more than {TOPOLOGY_ENTRIES} nodes and edges");
            let hint = "leave out elements that are not in the bag";
            return Err(Error::bad_file(path, line, reason, hint));
        }
        let [name, publish, subscribe, start, end] =
            columns.map(|at| at.and_then(|at| row.get(at)).map_or("", |cell| cell.trim()));
        if name.is_empty() {
            return Err(wrong(line, "the name is empty".to_owned()));
        }
        let list =
            |cell| python_list(cell).ok_or_else(|| wrong(line, format!("`{cell}` is not a list")));
        let time = |cell| {
            seconds(cell).ok_or_else(|| wrong(line, format!("`{cell}` is not a number of seconds")))
        };
        let (from_ns, to_ns) = (time(start)?, time(end)?);
        if let (Some(from), Some(to)) = (from_ns, to_ns)
            && to < from
        {
            let reason = format!("the end {end} is before the start {start}");
            return Err(wrong(line, reason));
        }
        let mut add = |element| {
            topology.entries.push(TopologyEntry {
                from_ns,
                to_ns,
                ..TopologyEntry::new(element, place(path, line))
            });
        };
        let node = resolved(name);
        add(NamedElement::Node(node.clone()));
        for topic in list(publish)? {
            add(NamedElement::Publish(node.clone(), resolved(&topic)));
        }
        for topic in list(subscribe)? {
            add(NamedElement::Subscribe(node.clone(), resolved(&topic)));
        }
    }
    Ok(topology)
}

/// Seconds as nanoseconds; `Some(None)` for an empty cell.
#[expect(clippy::option_option, reason = "an empty cell is not an error")]
fn seconds(cell: &str) -> Option<Option<i64>> {
    if ["", "nan", "None"].contains(&cell) {
        return Some(None);
    }
    let seconds: f64 = cell.parse().ok()?;
    let sound = seconds.is_finite() && seconds.abs() < 9e9;
    sound.then(|| Some(cast::to_i64(seconds * 1e9)))
}

/// The strings in `['a', "b"]`; an empty cell is an empty list, one bare name a list of one.
fn python_list(cell: &str) -> Option<Vec<String>> {
    if ["", "nan", "None"].contains(&cell) {
        return Some(Vec::new());
    }
    let opened = cell.strip_prefix(['[', '(', '{']);
    let Some(inside) = opened.and_then(|rest| rest.strip_suffix([']', ')', '}'])) else {
        return (!cell.contains(['[', ']', '\'', '"', ','])).then(|| vec![cell.to_owned()]);
    };
    let mut list = Vec::new();
    let mut rest = inside.trim();
    while !rest.is_empty() {
        let quote = rest.chars().next().filter(|c| ['\'', '"'].contains(c))?;
        let (text, after) = rest[1..].split_once(quote)?;
        list.push(text.to_owned());
        rest = after.trim_start();
        rest = match rest.strip_prefix(',') {
            Some(next) => next.trim_start(),
            None if rest.is_empty() => rest,
            None => return None,
        };
    }
    Some(list)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn parse(text: &str) -> Result<Topology> {
        read(Path::new("robot.csv"), text)
    }

    #[test]
    fn a_row_is_a_node_with_topics_and_lifetime() {
        let text = "Name,Publish,Subscribe,Node-start,Node-end\nplanner,\"['/plan', '/path']\",['/map'],10,20.5\n";
        let entries = parse(text).unwrap().entries;
        assert_eq!(entries.len(), 4);
        assert_eq!(
            entries[2].element,
            NamedElement::Publish("/planner".into(), "/path".into())
        );
        assert_eq!(
            (entries[0].from_ns, entries[0].to_ns),
            (Some(10_000_000_000), Some(20_500_000_000))
        );
        assert_eq!(entries[3].place, "robot.csv line 2");
    }

    #[test]
    fn an_endless_table_is_refused_while_reading() {
        let rows: Vec<String> = (0..TOPOLOGY_ENTRIES + 10)
            .map(|n| format!("n{n},,,,\n"))
            .collect();
        let rows = rows.concat();
        let text = format!("Name,Publish,Subscribe,Node-start,Node-end\n{rows}");
        let error = parse(&text).unwrap_err().to_string();
        assert!(
            error.contains("line 131075") && error.contains("more than 131072"),
            "{error}"
        );
    }

    #[test]
    fn errors_have_their_line() {
        for (row, stated) in [
            ("a,[/x],,,", "is not a list"),
            ("a,,,soon,", "not a number"),
            (",,,,", "empty"),
            ("a,,,5,4", "before"),
        ] {
            let text = format!("Name,Publish,Subscribe,Node-start,Node-end\nok,,,,\n{row}\n");
            let error = parse(&text).unwrap_err().to_string();
            assert!(
                error.contains("line 3") && error.contains(stated),
                "{error}"
            );
        }
    }
}
