//! Advice on getting more information: from this recording, and from the next one by other `record` options.

use super::Info;
use crate::base::words::count;
use crate::evidence::Evidence;

/// Advice on getting more information: first from this bag, then when recording. Empty if nothing is missing, and for
/// missions that were not recorded (`is_ros1` is `None`).
pub(super) fn advice(info: &Info, is_ros1: Option<bool>) -> Vec<String> {
    match is_ros1 {
        None => Vec::new(),
        Some(true) => ros1(info),
        Some(false) => ros2(info),
    }
}

fn has(info: &Info, topic: &str) -> bool {
    info.topics.iter().any(|t| t.name == topic)
}

fn ros1(info: &Info) -> Vec<String> {
    let mut advice = Vec::new();
    let deaf = info.topics_without_subscriber;
    if !has(info, "/rosout") {
        advice.push(
            "also record `/rosout`, which reveals nodes that publish nothing else".to_owned(),
        );
    }
    if deaf > 0 && !has(info, "/statistics") {
        advice.extend(from_files(info));
        advice.push(format!(
            "{} without a known subscriber; before the nodes start run `rosparam set /enable_statistics true`, \
             then `rosbag record -a`",
            count(deaf, "topic")
        ));
    }
    advice
}

fn ros2(info: &Info) -> Vec<String> {
    let mut advice = Vec::new();
    if has(info, "/rosgraph") || info.topics_without_publisher + info.topics_without_subscriber == 0
    {
        return advice;
    }
    advice.push(format!(
        "rosbag2 does not record publishers or subscribers: {} without a known publisher, {} without a known subscriber",
        info.topics_without_publisher, info.topics_without_subscriber
    ));
    advice.extend(from_files(info));
    for (topic, reveals) in [
        ("/rosout", "nodes that log"),
        (
            "/parameter_events",
            "nodes that start, and the ends that they declare",
        ),
    ] {
        if !has(info, topic) {
            advice.push(format!("also record `{topic}`, which reveals {reveals}"));
        }
    }
    advice.push(
        "next time run `ros2 run rosgraph_monitor rosgraph_monitor_node`, then `ros2 bag record --all`: its topic `/rosgraph` contains the whole graph"
            .to_owned(),
    );
    advice
}

/// Advice on files that can complement the bag.
fn from_files(info: &Info) -> Vec<String> {
    let mut advice = Vec::new();
    let named = info.nodes_by_degree.total();
    let has = |is_it: fn(&str) -> bool| info.evidence.iter().any(|row| is_it(row.source));
    let is_read = !info.undrawn.is_empty() || has(|source| source.starts_with("source"));
    if named > 0 && !is_read && Evidence::all_words().any(|word| word == "source") {
        advice.push(format!(
            "`--source FOLDER` adds what the source code of the {named} named nodes declares"
        ));
    }
    if !has(|source| ["topology", "launch"].contains(&source)) {
        let text =
            "`--topology FILE` adds a launch file, a graph saved by rqt_graph, or a table of nodes";
        advice.push(text.to_owned());
    }
    advice
}
