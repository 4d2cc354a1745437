//! The functions and classes of the client libraries that create publishers and subscribers.

use super::super::declaration::Made;
use super::names::unscoped;
use crate::evidence::syntax::{Node, Parsed};

/// The parts of a called name: `object.name<template>(…)`, `scope::name<template>(…)`.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) struct Callee<'a> {
    pub(super) name: &'a str,
    /// The object; empty without one.
    pub(super) object: &'a str,
    /// The scope; empty without one.
    pub(super) scope: &'a str,
    /// The first argument of the template; empty without one.
    pub(super) template: &'a str,
}

impl<'a> Callee<'a> {
    pub(super) fn of(parsed: &'a Parsed, call: Node<'a>) -> Self {
        let mut callee = Self::default();
        let Some(mut function) = call.child_by_field_name("function") else {
            return callee;
        };
        if function.kind() == "field_expression" {
            callee.object = parsed.field(function, "argument");
        }
        // Names inside names: `a::b::c<T>`, `object.c<T>`.
        for _ in 0..8 {
            let field = |name| function.child_by_field_name(name);
            let inner = match function.kind() {
                "field_expression" => field("field"),
                "qualified_identifier" => {
                    callee.scope = parsed.field(function, "scope");
                    field("name")
                }
                "template_function" | "template_method" => {
                    let first = field("arguments").and_then(|list| list.named_child(0));
                    callee.template = first.map_or("", |n| parsed.text(n));
                    field("name")
                }
                _ => None,
            };
            let Some(inner) = inner else { break };
            function = inner;
        }
        callee.name = parsed.text(function);
        callee
    }
}

/// The kind of object that a function creates.
pub(super) fn by_function(callee: &Callee<'_>) -> Option<Made> {
    let has_type = !callee.template.is_empty();
    let is_transport = callee.scope.ends_with("image_transport");
    Some(match callee.name {
        "create_publisher" if is_transport => Made::ImagePublisher,
        "create_subscription" if is_transport => Made::Subscriber,
        "create_camera_publisher" | "advertiseCamera" => Made::CameraPublisher,
        "create_camera_subscription" | "subscribeCamera" => Made::CameraSubscriber,
        "create_publisher" | "advertise" if has_type => Made::Publisher,
        // Only image transport advertises without a type.
        "advertise" => Made::ImagePublisher,
        "create_subscription" => Made::Subscriber,
        "subscribe" if !callee.object.is_empty() => Made::Subscriber,
        "waitForMessage" if has_type => Made::Moment,
        "create_server" if callee.scope.ends_with("rclcpp_action") => Made::ActionServer2,
        "create_client" if callee.scope.ends_with("rclcpp_action") => Made::ActionClient2,
        _ => return None,
    })
}

/// The kind of object that constructing a variable of this type, or a pointer to it, creates, with its template's type.
pub(super) fn by_constructor(kind: &str) -> Option<(Made, &str)> {
    let (before, inner) = kind.split_once('<')?;
    let inner = inner.trim().strip_suffix('>')?;
    let (scope, name) = before
        .trim()
        .rsplit_once("::")
        .unwrap_or(("", before.trim()));
    match (unscoped(scope), name) {
        ("message_filters", "Subscriber") => Some((Made::Subscriber, inner)),
        ("realtime_tools", "RealtimePublisher") => Some((Made::Publisher, inner)),
        ("actionlib", "SimpleActionServer" | "ActionServer") => Some((Made::ActionServer1, inner)),
        ("actionlib", "SimpleActionClient" | "ActionClient") => Some((Made::ActionClient1, inner)),
        (_, "shared_ptr" | "unique_ptr" | "scoped_ptr") => by_constructor(inner),
        _ => None,
    }
}

/// The kind of object that a transform class creates.
pub(super) fn transform(scope: &str, name: &str) -> Option<Made> {
    Some(match (scope, name) {
        ("tf" | "tf2_ros", "TransformBroadcaster") => Made::Broadcaster,
        ("tf2_ros", "StaticTransformBroadcaster") => Made::StaticBroadcaster,
        ("tf" | "tf2_ros", "TransformListener") => Made::Listener,
        _ => return None,
    })
}

/// Whether a class of this name writes bags.
pub(super) fn is_recorder(name: &str, full: &str) -> bool {
    let full = full.trim_start_matches("::");
    matches!(name, "SequentialWriter" | "Recorder")
        || name == "Writer" && full.starts_with("rosbag2_cpp")
}
