//! Contracts of well-known nodes: the topics that a node of a known package publishes and subscribes under
//! its default names, as `contracts.csv` lists it. It applies if the bag names the node and has the topic
//! with that type.
//!
//! Each row names the source files that its program logs from: a node of that name that only logs from other
//! files is another program. A row without a node's name applies to every node that logs from one of its
//! files.

use std::collections::BTreeSet;
use std::sync::Arc;

use super::SourceContext;
use crate::base::csv;
use crate::base::ids::Few;
use crate::base::name::{last_part, resolved};
use crate::evidence::inference::{Conclusions, ElementKey, verb};
use crate::evidence::message::dynamic::LogRecord;
use crate::evidence::observation::{Name, Observation};

const TABLE: &str = include_str!("contracts.csv");

/// Folders of the client libraries, which log under the name of every node.
const LIBRARIES: [&str; 4] = [
    "/libros/",
    "/src/rclcpp/",
    "-packages/rospy/",
    "-packages/rclpy/",
];

/// Whether a file is part of many programs, so that it does not distinguish them: a header, or a client
/// library's.
fn is_shared(path: &str) -> bool {
    matches!(path.rsplit_once('.'), Some((_, "h" | "hpp")))
        || LIBRARIES.iter().any(|folder| path.contains(folder))
}

/// Keeps the source file that a node logs from.
pub(crate) fn read(context: &mut SourceContext<'_>, record: &LogRecord<'_>) {
    let file = record.file_name();
    if !record.logger.is_empty() && !file.is_empty() && !is_shared(record.file) {
        let (logger, file) = (context.name(&record.logger), context.name(file));
        context.states(Observation::LogsFrom(logger, file), String::new);
    }
}

/// A row of the table.
#[derive(Clone)]
struct Contract {
    /// The node's own name, without a namespace; empty for any.
    node: String,
    /// The source files that it logs from.
    files: Vec<String>,
    /// The version of ROS, `1` or `2`; empty for either.
    ros: String,
    publishes: bool,
    /// As a node names it: `scan` in its namespace, `../map` in the one around, `~/map` below its name, `/tf` for all.
    topic: String,
    kind: String,
    /// Whether no other program publishes this type.
    owns: bool,
    package: String,
    /// The line of the row in the table, ≥ 1.
    line: usize,
    /// The address of the code that shows it.
    reference: String,
}

/// The rows of the table; malformed rows are left out.
fn contracts() -> Vec<Contract> {
    let rows = csv::records(TABLE).unwrap_or_default().into_iter().skip(1);
    rows.filter_map(|(line, row)| contract(line, &row))
        .collect()
}

fn contract(line: usize, row: &[String]) -> Option<Contract> {
    let [
        node,
        files,
        ros,
        role,
        topic,
        kind,
        owns,
        package,
        reference,
    ] = row
    else {
        return None;
    };
    Some(Contract {
        node: node.clone(),
        files: files.split_whitespace().map(str::to_owned).collect(),
        ros: ros.clone(),
        publishes: role == "publishes",
        topic: topic.clone(),
        kind: kind.clone(),
        owns: owns == "yes",
        package: package.clone(),
        line,
        reference: reference.clone(),
    })
}

pub(crate) fn conclude(known: &mut Conclusions<'_>) {
    let files = files(known);
    let nodes = known.nodes().clone();
    let mut publishers: Few<Name, Vec<(Name, Contract)>> = Few::default();
    for contract in Owners::new(known).0 {
        for node in nodes.iter().copied() {
            let name = known.text(node);
            let own = files.get(node).filter(|own| !own.is_empty());
            if !is_meant(&contract, &name, own) {
                continue;
            }
            let topic = known.facts.known(&resolved(&contract.topic, &name));
            let Some(topic) = topic.filter(|t| known.kind(*t) == contract.kind) else {
                continue;
            };
            if contract.publishes {
                publishers.grown(topic).push((node, contract.clone()));
            } else if !known.knows(ElementKey::Publish(node, topic)) {
                let what = ElementKey::Subscribe(topic, node);
                known.infer(what, ElementKey::Node(node), |known| {
                    words(known, node, &contract)
                });
            }
        }
    }
    for (topic, nodes) in publishers.with_ids() {
        let new = nodes.iter().map(|(node, _)| *node);
        let all: BTreeSet<Name> = known.publishers(topic).chain(new).collect();
        // There are no more than the bag counts.
        if known.offers(topic).is_none_or(|n| all.len() <= n as usize) {
            for (node, contract) in nodes {
                known.infer_publisher(*node, topic, |known| words(known, *node, contract));
            }
        }
    }
}

fn words(known: &Conclusions<'_>, node: Name, contract: &Contract) -> String {
    format!(
        "{} is assumed to be the one of package {}, which {} {} (contracts.csv line {}: {})",
        known.text(node),
        contract.package,
        verb(contract.publishes),
        contract.topic,
        contract.line,
        contract.reference.trim_start_matches("https://")
    )
}

/// The well-known programs of the recording's version of ROS, and the types that one of them alone publishes.
pub(crate) struct Owners(Vec<Contract>);

impl Owners {
    /// Reads the table.
    pub(crate) fn new(known: &Conclusions<'_>) -> Self {
        Self::of(if known.is_ros1() { "2" } else { "1" })
    }

    /// The rows that are not for this version of ROS alone.
    fn of(foreign: &str) -> Self {
        let rows = contracts().into_iter().filter(|c| c.ros != foreign);
        Self(rows.collect())
    }

    /// The default name of the node that publishes messages of this type: in the namespace in which it would publish
    /// `topic`.
    pub(crate) fn node(&self, kind: &str, topic: &str) -> Option<String> {
        let row = self.0.iter().find(|c| c.owns && c.kind == kind)?;
        let space = topic.strip_suffix(row.topic.as_str());
        let space = space.filter(|_| !row.topic.starts_with('/'));
        let space = space.map_or("", |space| space.trim_end_matches('/'));
        Some(format!("{space}/{}", row.node))
    }

    /// The recorded topics of matching types that the owner of a type, with this name, also publishes (true) and
    /// subscribes to.
    pub(crate) fn others(
        &self,
        known: &Conclusions<'_>,
        kind: &str,
        node: &str,
    ) -> Vec<(bool, Name)> {
        let owner = self.0.iter().find(|c| c.owns && c.kind == kind);
        let is_other = |row: &&Contract| {
            owner.is_some_and(|own| own.node == row.node && own.package == row.package)
        };
        let recorded = |row: &Contract| {
            let topic = known.facts.known(&resolved(&row.topic, node));
            let topic = topic.filter(|topic| known.kind(*topic) == row.kind)?;
            Some((row.publishes, topic))
        };
        let others = self.0.iter().filter(is_other);
        others.filter_map(recorded).collect()
    }
}

/// The files that each node logs from.
fn files(known: &Conclusions<'_>) -> Few<Name, BTreeSet<Arc<str>>> {
    let mut files: Few<Name, BTreeSet<Arc<str>>> = Few::default();
    for fact in &known.facts.list {
        if let Observation::LogsFrom(logger, file) = fact.observation
            && let Some(node) = known.owner(&known.text(logger))
        {
            files.grown(node).insert(known.text(file));
        }
    }
    files
}

/// Whether a row applies to a node of this name that logs from these files.
fn is_meant(contract: &Contract, node: &str, files: Option<&BTreeSet<Arc<str>>>) -> bool {
    let own = |files: &BTreeSet<Arc<str>>| contract.files.iter().any(|f| files.contains(&**f));
    if contract.node.is_empty() {
        files.is_some_and(own)
    } else {
        last_part(node) == contract.node && files.is_none_or(own)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_row_of_the_table_is_read_and_names_its_source() {
        let rows = csv::records(TABLE).unwrap();
        assert!(rows.len() > 60);
        for (line, row) in rows.iter().skip(1) {
            let contract =
                contract(*line, row).unwrap_or_else(|| panic!("line {line} has other columns"));
            let has_source = row[8].starts_with("https://github.com/") && row[8].contains("/blob/");
            assert!(has_source, "line {line} names no file");
            assert!(
                ["publishes", "subscribes"].contains(&&*row[3]),
                "line {line}"
            );
            assert!(["", "1", "2"].contains(&&*contract.ros), "line {line}");
            assert!(!contract.files.is_empty(), "line {line}");
            assert!(contract.kind.matches('/').count() == 1, "line {line}");
        }
    }

    #[test]
    fn a_node_of_another_program_does_not_match() {
        let row = [
            "amcl",
            "amcl_node.cpp",
            "",
            "subscribes",
            "scan",
            "a/B",
            "",
            "amcl",
            "https://x",
        ];
        let contract = contract(2, &row.map(str::to_owned)).unwrap();
        let files = |file: &str| BTreeSet::from([Arc::from(file)]);
        assert!(is_meant(&contract, "/r1/amcl", None));
        assert!(is_meant(
            &contract,
            "/r1/amcl",
            Some(&files("amcl_node.cpp"))
        ));
        assert!(!is_meant(&contract, "/r1/amcl", Some(&files("node.py"))));
        assert!(!is_meant(&contract, "/r1/amcl_2", None));
    }

    #[test]
    fn a_unique_type_identifies_its_program() {
        let owners = Owners::of("1");
        let owner = |topic| owners.node("turtlesim/Pose", topic);
        assert_eq!(owner("/turtle1/pose").as_deref(), Some("/turtlesim"));
        assert_eq!(owner("/r1/turtle1/pose").as_deref(), Some("/r1/turtlesim"));
        assert_eq!(owner("/pose").as_deref(), Some("/turtlesim"));
        assert_eq!(owners.node("std_msgs/String", "/chatter"), None);
        // The driver of ROS 1 has another name.
        let packets = |owners: Owners| owners.node("velodyne_msgs/VelodyneScan", "/packets");
        assert!(packets(owners).is_some() && packets(Owners::of("2")).is_none());
    }

    #[test]
    fn topics_are_resolved_by_the_nodes_namespace() {
        assert_eq!(resolved("scan", "/r1/amcl"), "/r1/scan");
        assert_eq!(resolved("scan", "/amcl"), "/scan");
        assert_eq!(resolved("~/odom", "/base"), "/base/odom");
        assert_eq!(resolved("/tf", "/r1/base"), "/tf");
        assert_eq!(resolved("../map", "/r1/costmap/costmap"), "/r1/map");
        assert_eq!(resolved("../map", "/costmap/costmap"), "/map");
    }

    #[test]
    fn a_log_record_of_a_shared_file_does_not_distinguish_programs() {
        let shared = [
            "./clients/roscpp/src/libros/connection.cpp",
            "./src/rclcpp/subscription_base.cpp",
            "/opt/ros/noetic/include/tf2_ros/message_filter.h",
            "/opt/ros/noetic/lib/python3/dist-packages/rospy/topics.py",
        ];
        assert!(shared.into_iter().all(is_shared));
        let own = ["./src/amcl_node.cpp", "/ws/examples/rclcpp/lambda.cpp"];
        assert!(!own.into_iter().any(is_shared));
    }
}
