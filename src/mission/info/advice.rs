//! What a recording would have needed to tell more, with the command to copy.

use crate::mission::Mission;

/// What to do next time so that the bag says what it does not say now; `deaf` topics carry messages and have no known
/// subscriber. Empty if nothing is missing, and for evolutions, which nobody records.
pub fn advice(mission: &Mission, deaf: usize) -> Vec<String> {
    let mut advice = Vec::new();
    let Some(bag) = mission.bags.first() else {
        return advice;
    };
    let elements = &mission.elements;
    let is_ros1 = bag.format == "rosbag1"
        || bag
            .facts
            .iter()
            .any(|(key, value)| key == "profile" && value == "ros1");
    let has = |name: &str| elements.topics.iter().any(|t| t.name.as_str() == name);
    if is_ros1 {
        if !has("/rosout") {
            advice.push("the bag has no `/rosout`, which names nodes that publish nothing else: record it too".to_owned());
        }
        if deaf > 0 && !has("/statistics") {
            advice.push(format!(
                "{deaf} topics have no known subscriber; before the nodes start run `rosparam set /enable_statistics true`, \
                 then `rosbag record -a`"
            ));
        }
    } else {
        for (topic, tells) in [
            ("/rosout", "nodes that log"),
            ("/parameter_events", "nodes that start"),
        ] {
            if !has(topic) {
                advice.push(format!(
                    "the bag has no `{topic}`, which names {tells}: record it too"
                ));
            }
        }
        if deaf > 0 && !has("/rosgraph") {
            advice.push(format!(
                "{deaf} topics have no known subscriber and rosbag2 stores no publisher; run the node `rosgraph_monitor_node` of \
                 the package `rosgraph_monitor`, then `ros2 bag record --all`: its topic `/rosgraph` tells the whole graph"
            ));
        }
    }
    advice
}
