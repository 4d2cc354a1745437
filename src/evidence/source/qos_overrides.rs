//! `qos_overrides.<topic>.publisher|subscription.<policy>` in parameter events of ROS 2: rclcpp declares
//! these parameters when it creates that publisher or subscription.

use std::collections::BTreeSet;

use super::SourceContext;
use crate::evidence::message::parameters::ParameterEvent;
use crate::evidence::observation::Observation;

pub(crate) fn read(context: &mut SourceContext<'_>, event: &ParameterEvent<'_>) {
    let ends: BTreeSet<_> = event.set.iter().filter_map(|p| end(p.name)).collect();
    for (topic, publishes) in ends {
        let (node, of) = (context.name(event.node), context.name(topic));
        let (word, observation) = if publishes {
            ("publisher", Observation::Publish(node, of))
        } else {
            ("subscription", Observation::Subscribe(node, of))
        };
        context.states(observation, || {
            format!("{} declares qos_overrides.{topic}.{word}", event.node)
        });
    }
}

/// The topic in the name of a parameter, and whether a publisher is meant. An entity may have its own id
/// (`publisher_front`).
fn end(parameter: &str) -> Option<(&str, bool)> {
    let rest = parameter.strip_prefix("qos_overrides.")?;
    let (entity, _policy) = rest.rsplit_once('.')?;
    let (topic, entity) = entity.rsplit_once('.')?;
    let kind = entity.split('_').next()?;
    let publishes = match kind {
        "publisher" => true,
        "subscription" => false,
        _ => return None,
    };
    topic.starts_with('/').then_some((topic, publishes))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_parameter_names_its_topic_and_end() {
        assert_eq!(
            end("qos_overrides./tf.publisher.depth"),
            Some(("/tf", true))
        );
        assert_eq!(
            end("qos_overrides./a/scan.subscription_left.history"),
            Some(("/a/scan", false))
        );
        for other in [
            "use_sim_time",
            "qos_overrides./tf.depth",
            "qos_overrides.tf.x.y",
        ] {
            assert_eq!(end(other), None);
        }
    }
}
