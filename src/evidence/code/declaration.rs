//! Declarations in source code: publishers, subscribers, nodes and their names, each with its location; and the values of names.

use std::cell::Cell;
use std::collections::BTreeMap;

use crate::base::words::{self, worded};
use crate::evidence::inference::ElementKey;
use crate::evidence::observation::Name;
use crate::evidence::syntax::Node;

worded! {
    /// The role of a node on a topic.
    #[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
    pub(crate) enum Role {
        Publishes = "publishes",
        Subscribes = "subscribes",
    }
}

impl Role {
    /// The edge of a node in this role.
    pub(super) fn edge(self, node: Name, topic: Name) -> ElementKey {
        ElementKey::edge(self == Self::Publishes, node, topic)
    }
}

/// The kind of object that a call creates.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(super) enum Made {
    Publisher,
    Subscriber,
    /// A call that waits for one message.
    Moment,
    /// A publisher of images and their compressed topics.
    ImagePublisher,
    CameraPublisher,
    CameraSubscriber,
    /// An action of ROS 1.
    ActionServer1,
    ActionClient1,
    /// An action of ROS 2.
    ActionServer2,
    ActionClient2,
    Broadcaster,
    StaticBroadcaster,
    Listener,
}

/// One publisher or subscriber in the code.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct Declaration {
    pub(crate) role: Role,
    /// The topic as written: `/x`, `x` in the node's namespace, `~/x` below the node; `None` if unknown.
    pub(crate) topic: Option<String>,
    /// The possible types, as `package/Name`; several only with wildcard imports.
    pub(crate) types: Vec<String>,
    /// The line, ≥ 1.
    pub(crate) line: usize,
    /// The call in short: `create_publisher(String, 'chatter')`.
    pub(crate) text: String,
    /// Whether it only lasts for one message.
    pub(crate) is_momentary: bool,
}

/// The code of a class, or of a file outside its classes (its name is empty). In C++ a class may be spread over files.
#[derive(Debug, Default, PartialEq, Eq)]
pub(crate) struct Class {
    pub(crate) name: String,
    /// The names of its base classes, without namespaces.
    pub(crate) bases: Vec<String>,
    /// The names that it gives to its node.
    pub(crate) node_names: Vec<String>,
    pub(crate) declarations: Vec<Declaration>,
    /// The classes that may be instantiated here, with the name passed in the call, if any.
    pub(crate) mentions: BTreeMap<String, Option<String>>,
    /// Whether the class itself is defined here, not only functions of it.
    pub(crate) is_defined: bool,
    /// Whether it writes bags.
    pub(crate) is_recorder: bool,
    /// Whether it logs.
    pub(crate) logs: bool,
    /// The line, ≥ 1.
    pub(crate) line: usize,
}

/// The classes of a file, the first one for what is outside of all, and those around the visited element.
pub(super) struct Classes {
    pub(super) all: Vec<Class>,
    /// The ends of the enclosing classes, with their indices.
    pub(super) open: Vec<(usize, usize)>,
}

impl Default for Classes {
    fn default() -> Self {
        Self {
            all: vec![Class::default()],
            open: Vec::new(),
        }
    }
}

impl Classes {
    /// Leaves the classes that do not contain an element.
    pub(super) fn leave(&mut self, node: Node<'_>) {
        let contains = |(end, _): &(usize, usize)| *end > node.start_byte();
        self.open.retain(contains);
    }

    pub(super) fn enter(&mut self, node: Node<'_>, class: usize) {
        self.open.push((node.end_byte(), class));
    }

    /// The innermost class around the element.
    pub(super) fn current(&mut self) -> &mut Class {
        let at = self.open.last().map_or(0, |(_, at)| *at);
        let last = self.all.len() - 1;
        &mut self.all[at.min(last)]
    }
}

/// The content of a source file.
#[derive(Default)]
pub(crate) struct FileCode {
    /// The code outside classes first.
    pub(crate) classes: Vec<Class>,
    /// Python: names and the modules that they are imported from, `.` for this package.
    pub(crate) imports: BTreeMap<String, String>,
}

/// A call that creates an object: its topic and types as far as known.
pub(super) struct Call {
    pub(super) made: Made,
    pub(super) topic: Option<String>,
    pub(super) types: Vec<String>,
    pub(super) line: usize,
    pub(super) text: String,
}

impl Call {
    /// The resulting publishers and subscribers.
    pub(super) fn declarations(&self) -> Vec<Declaration> {
        use Role::{Publishes, Subscribes};
        let below = |role, suffix: &str, types: Vec<String>| {
            let topic = self.topic.as_ref().map(|topic| format!("{topic}{suffix}"));
            self.declaration(role, topic, types)
        };
        let types = self.types.iter();
        let one = |role, suffix, ending| {
            let types = types.clone().map(|own| format!("{own}{ending}"));
            below(role, suffix, types.collect())
        };
        let fixed = |role, suffix, name: &str| {
            let types = types.clone().map(|_| name.to_owned());
            below(role, suffix, types.collect())
        };
        let image = |role, suffix, name| below(role, suffix, vec![format!("sensor_msgs/{name}")]);
        let transform = |role, topic: &str| {
            let types = vec!["tf2_msgs/TFMessage".to_owned()];
            self.declaration(role, Some(topic.to_owned()), types)
        };
        let info = |role| {
            let beside = |topic: &String| match topic.rsplit_once('/') {
                Some((folder, _)) => format!("{folder}/camera_info"),
                None => "camera_info".to_owned(),
            };
            let types = vec!["sensor_msgs/CameraInfo".to_owned()];
            self.declaration(role, self.topic.as_ref().map(beside), types)
        };
        // The roles on an action's outgoing (feedback, result, status) and incoming (goal, cancel) topics.
        let action1 = |publishes, stated| {
            vec![
                one(publishes, "/feedback", "Feedback"),
                one(publishes, "/result", "Result"),
                fixed(publishes, "/status", "actionlib_msgs/GoalStatusArray"),
                one(stated, "/goal", "Goal"),
                fixed(stated, "/cancel", "actionlib_msgs/GoalID"),
            ]
        };
        let action2 = |publishes| {
            vec![
                one(publishes, "/_action/feedback", "_FeedbackMessage"),
                fixed(publishes, "/_action/status", "action_msgs/GoalStatusArray"),
            ]
        };
        match self.made {
            Made::Publisher => vec![one(Publishes, "", "")],
            Made::Subscriber | Made::Moment => vec![one(Subscribes, "", "")],
            Made::ImagePublisher => vec![
                image(Publishes, "", "Image"),
                image(Publishes, "/compressed", "CompressedImage"),
                image(Publishes, "/compressedDepth", "CompressedImage"),
            ],
            Made::CameraPublisher => vec![
                image(Publishes, "", "Image"),
                image(Publishes, "/compressed", "CompressedImage"),
                info(Publishes),
            ],
            Made::CameraSubscriber => vec![image(Subscribes, "", "Image"), info(Subscribes)],
            Made::ActionServer1 => action1(Publishes, Subscribes),
            Made::ActionClient1 => action1(Subscribes, Publishes),
            Made::ActionServer2 => action2(Publishes),
            Made::ActionClient2 => action2(Subscribes),
            Made::Broadcaster => vec![transform(Publishes, "/tf")],
            Made::StaticBroadcaster => vec![transform(Publishes, "/tf_static")],
            Made::Listener => vec![
                transform(Subscribes, "/tf"),
                transform(Subscribes, "/tf_static"),
            ],
        }
    }

    fn declaration(&self, role: Role, topic: Option<String>, types: Vec<String>) -> Declaration {
        Declaration {
            role,
            topic,
            types,
            line: self.line,
            text: self.text.clone(),
            is_momentary: self.made == Made::Moment,
        }
    }
}

/// The type named by these parts, as `package/Name`: `std_msgs msg String`, `std_msgs String`. `None` for names without
/// a package.
pub(super) fn type_of<'a>(parts: impl IntoIterator<Item = &'a str>) -> Option<String> {
    let parts = parts.into_iter().filter(|part| !part.is_empty());
    let parts: Vec<&str> = parts.collect();
    let [.., package, name] = parts[..] else {
        return None;
    };
    let is_kind = ["msg", "action", "srv"].contains(&package);
    let package = if is_kind {
        *parts.get(parts.len().checked_sub(3)?)?
    } else {
        package
    };
    Some(type_key(&format!("{package}/{name}")))
}

/// A type's name in the form for comparisons: `std_msgs/msg/String` is `std_msgs/String`, and the old type of `/tf` is
/// the new one.
pub(crate) fn type_key(type_name: &str) -> String {
    if type_name == "tf/tfMessage" {
        return "tf2_msgs/TFMessage".to_owned();
    }
    match type_name.split('/').collect::<Vec<_>>()[..] {
        [package, "msg" | "action", name] => format!("{package}/{name}"),
        _ => type_name.to_owned(),
    }
}

/// A text on one line, cut if long; a call may span lines.
pub(super) fn short(text: &str) -> String {
    let words = text.split_whitespace().collect::<Vec<_>>().join(" ");
    words::shorten(&words, 100).into_owned()
}

// The values of names and parameters, where each has only one.

/// The longest text that is assembled, in bytes: longer than any topic.
pub(super) const LONGEST: usize = 1000;

/// The most steps from name to name that are followed, as names may be circular: code in use takes three.
pub(super) const DEEPEST: usize = 8;

/// Names with the expressions assigned to them; a name with several has no known value.
pub(super) struct TextValues<'a> {
    /// The number of expressions that may still be evaluated for their texts.
    work: Cell<usize>,
    names: BTreeMap<String, Option<Node<'a>>>,
    parameters: BTreeMap<String, Option<Node<'a>>>,
}

impl<'a> TextValues<'a> {
    /// The values of a file of this many bytes. As many expressions may be evaluated: hand-written code needs a tenth, and
    /// names that refer to each other repeatedly cost no more than reading the file.
    pub(super) fn new(bytes: usize) -> Self {
        Self {
            work: Cell::new(1000 + bytes),
            names: BTreeMap::new(),
            parameters: BTreeMap::new(),
        }
    }

    /// Counts an expression at this depth; `None` if it is too deep or there were too many.
    pub(super) fn evaluate(&self, depth: usize) -> Option<()> {
        self.work.set(self.work.get().checked_sub(1)?);
        (depth <= DEEPEST).then_some(())
    }

    /// Records an assignment to a name.
    pub(super) fn set(&mut self, name: &str, value: Node<'a>) {
        put(&mut self.names, name, value);
    }

    /// Records a parameter's default.
    pub(super) fn set_parameter(&mut self, name: &str, value: Node<'a>) {
        put(&mut self.parameters, name, value);
    }

    pub(super) fn get(&self, name: &str) -> Option<Node<'a>> {
        *self.names.get(name)?
    }

    pub(super) fn parameter(&self, name: &str) -> Option<Node<'a>> {
        *self.parameters.get(name)?
    }
}

fn put<'a>(map: &mut BTreeMap<String, Option<Node<'a>>>, name: &str, value: Node<'a>) {
    match map.get_mut(name) {
        Some(known) => *known = None,
        None => {
            map.insert(name.to_owned(), Some(value));
        }
    }
}
