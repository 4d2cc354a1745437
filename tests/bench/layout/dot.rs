//! The same graph laid out by Graphviz `dot`, with namespaces as clusters.

use std::fmt::Write as _;
use std::io::Write as _;
use std::process::{Command, Stdio};

use bagreel::internals::base::geometry::{Point, Rect, Size};
use bagreel::internals::layout::{Layout, Orientation, Plan, Route};

/// The layout by `dot`; `None` if it is not installed or takes longer than `seconds`.
pub(crate) fn lay_out(
    plan: &Plan,
    orientation: Orientation,
    clustered: bool,
    seconds: u32,
) -> Option<Layout> {
    let mut dot = Command::new("timeout")
        .args([&seconds.to_string(), "dot", "-Tplain"])
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .stderr(Stdio::null())
        .spawn()
        .ok()?;
    let text = source(plan, orientation, clustered);
    dot.stdin.take()?.write_all(text.as_bytes()).ok()?;
    let out = dot.wait_with_output().ok()?;
    out.status
        .success()
        .then(|| parse(&String::from_utf8_lossy(&out.stdout), plan, orientation))
        .flatten()
}

fn source(plan: &Plan, orientation: Orientation, clustered: bool) -> String {
    let mut out = format!(
        "digraph {{ rankdir={}; node [shape=box fixedsize=true label=\"\"]; edge [arrowhead=none];\n",
        orientation.word()
    );
    for (v, vertex) in plan.vertices.iter().enumerate() {
        let _ = writeln!(
            out,
            "{v} [width={:.4} height={:.4}];",
            vertex.size.w / 72.0,
            vertex.size.h / 72.0
        );
    }
    if clustered {
        for c in (0..plan.clusters.len()).filter(|&c| plan.clusters[c].parent.is_none()) {
            cluster(plan, c, &mut out);
        }
    }
    for link in &plan.links {
        let _ = writeln!(out, "{} -> {};", link.from, link.to);
    }
    out + "}"
}

fn cluster(plan: &Plan, c: usize, out: &mut String) {
    let _ = writeln!(
        out,
        "subgraph cluster_{c} {{ label=\"{}\"; fontsize=11; labeljust=l;",
        "n".repeat((plan.clusters[c].title.w / 6.0) as usize)
    );
    for (v, _) in plan
        .vertices
        .iter()
        .enumerate()
        .filter(|(_, v)| v.cluster == Some(c))
    {
        let _ = writeln!(out, "{v};");
    }
    for child in (0..plan.clusters.len()).filter(|&k| plan.clusters[k].parent == Some(c)) {
        cluster(plan, child, out);
    }
    *out += "}\n";
}

/// Reads `dot -Tplain`: inches, y up.
fn parse(text: &str, plan: &Plan, orientation: Orientation) -> Option<Layout> {
    let mut layout = Layout {
        orientation,
        size: Size::default(),
        boxes: vec![Rect::default(); plan.vertices.len()],
        routes: vec![Route::default(); plan.links.len()],
        clusters: vec![Rect::default(); plan.clusters.len()],
        remarks: Vec::new(),
    };
    let mut used = vec![false; plan.links.len()];
    for line in text.lines() {
        let mut words = line.split_whitespace();
        let kind = words.next()?;
        let numbers: Vec<f64> = words.map_while(|word| word.parse().ok()).collect();
        let point = |at: usize, height: f64| {
            Point::new(numbers[at] * 72.0, height - numbers[at + 1] * 72.0)
        };
        match kind {
            "graph" => layout.size = Size::new(numbers[1] * 72.0, numbers[2] * 72.0),
            "node" => {
                let v = numbers[0] as usize;
                layout.boxes[v] = Rect::around(point(1, layout.size.h), plan.vertices[v].size);
            }
            "edge" => {
                let ends = (numbers[0] as usize, numbers[1] as usize);
                let link = (0..used.len())
                    .find(|&i| !used[i] && (plan.links[i].from, plan.links[i].to) == ends)?;
                used[link] = true;
                let points: Vec<Point> = (0..numbers[2] as usize)
                    .map(|i| point(3 + 2 * i, layout.size.h))
                    .collect();
                layout.routes[link] = Route {
                    start: points[0],
                    curves: points[1..]
                        .chunks_exact(3)
                        .map(|c| [c[0], c[1], c[2]])
                        .collect(),
                    label: None,
                };
            }
            _ => {}
        }
    }
    Some(layout)
}
