//! A mission's JSON window by window: each with its `nodes`, `topics`, `publishes` and `subscribes`.

use std::collections::BTreeMap;

use serde_json::{Map, Value, json};

const LISTS: [(&str, &str); 4] = [
    ("node", "nodes"),
    ("topic", "topics"),
    ("publish", "publishes"),
    ("subscribe", "subscribes"),
];

/// The values of a column, of which `[value, times]` are several.
fn values(column: &Value) -> Vec<Value> {
    let cells = column.as_array().unwrap().iter();
    let cells = cells.flat_map(|cell| match cell.as_array() {
        Some(run) => vec![run[0].clone(); usize::try_from(run[1].as_u64().unwrap()).unwrap()],
        None => vec![cell.clone()],
    });
    cells.collect()
}

/// The windows of a mission with the elements that exist in each, and their states and numbers there.
pub fn windows(mission: &Value) -> Vec<Value> {
    let mut windows = mission["windows"].as_array().unwrap().clone();
    for window in &mut windows {
        for (_, list) in LISTS {
            window[list] = json!([]);
        }
    }
    for element in mission["elements"].as_array().unwrap() {
        let mut plain = element.as_object().unwrap().clone();
        let mut columns = plain.remove("in").unwrap().as_object().unwrap().clone();
        let index = |at: &Value| usize::try_from(at.as_u64().unwrap()).unwrap();
        let runs = columns.remove("windows").unwrap();
        let runs = runs.as_array().unwrap().iter();
        let there: Vec<usize> = runs
            .flat_map(|run| index(&run[0])..=index(&run[1]))
            .collect();
        let mut rows = vec![plain; there.len()];
        for (key, column) in &columns {
            for (row, value) in rows.iter_mut().zip(values(column)) {
                row.insert(key.clone(), value);
            }
        }
        let list = LISTS.iter().find(|(what, _)| element["what"] == *what);
        for (at, mut row) in there.into_iter().zip(rows) {
            let nanos = |key: &str| windows[at][key].as_i64().unwrap();
            let seconds = (nanos("end_ns") - nanos("start_ns")) as f64 / 1e9;
            let count = row.remove("sent").or_else(|| row.get("count").cloned());
            if row.get("hz").is_none_or(|hz| hz == "=") {
                let count = count.and_then(|count| count.as_f64());
                row.insert("hz".to_owned(), json!(count.map(|count| count / seconds)));
            }
            let rows = windows[at][list.unwrap().1].as_array_mut().unwrap();
            rows.push(Value::Object(row));
        }
    }
    windows
}

/// The keys that an element has in each window.
const COLUMNS: [&str; 6] = ["state", "degree", "count", "bytes", "hz", "lifecycle"];

/// An element: the keys that it has in every window, and its rows with their windows.
type Rows = (Map<String, Value>, Vec<(usize, Value)>);

/// The mission of such windows, all of whose elements are listed.
pub fn mission(mut windows: Vec<Value>) -> Value {
    let mut elements: BTreeMap<(usize, String), Rows> = BTreeMap::new();
    for (at, window) in windows.iter_mut().enumerate() {
        for (kind, (what, list)) in LISTS.into_iter().enumerate() {
            let rows = window.as_object_mut().unwrap().remove(list);
            for row in rows
                .as_ref()
                .and_then(Value::as_array)
                .into_iter()
                .flatten()
            {
                let name = [&row["name"], &row["node"], &row["topic"]].map(ToString::to_string);
                let element = elements.entry((kind, name.concat())).or_default();
                let kept = row.as_object().unwrap().clone().into_iter();
                let kept = kept.filter(|(key, _)| !COLUMNS.contains(&key.as_str()));
                element.0.extend(kept);
                element.0.insert("what".to_owned(), what.into());
                element.1.push((at, row.clone()));
            }
        }
    }
    let elements = elements.into_values().map(|(mut element, there)| {
        let runs: Vec<_> = there.iter().map(|(at, _)| [at, at]).collect();
        let mut columns = json!({ "windows": runs });
        for key in COLUMNS {
            let column: Vec<&Value> = there.iter().map(|(_, row)| &row[key]).collect();
            // Without rates, they would be computed from counts.
            if key == "hz" || column.iter().all(|value| !value.is_null()) {
                columns[key] = json!(column);
            }
        }
        element.insert("in".to_owned(), columns);
        element
    });
    let elements: Vec<_> = elements.collect();
    json!({"schema": "bagreel.mission/3", "windows": windows, "elements": elements})
}
