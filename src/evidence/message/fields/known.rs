//! Message types that bags may use without definition: those of ROS's common packages, and those in the user's files.
//!
//! rosbag2's sqlite3 recordings contain no definitions before ROS 2 Iron.

use std::path::Path;
use std::sync::{Arc, LazyLock};

use super::definition::{self, MessageFields};
use super::idl;
use crate::base::words::visible;

/// The suffix of a type's name for its fields before they changed.
const BEFORE: &str = " before";

/// The version of the built-in types.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Carried {
    Ros1,
    Ros2,
    /// ROS 2 before some of them changed.
    OlderRos2,
}

/// Types by package and name, the user's own first.
#[derive(Clone, Debug, Default)]
pub(crate) struct KnownTypes {
    own: Vec<Arc<MessageFields>>,
}

/// The fields of common packages' types, each with whether it is an earlier version. The texts are generated
/// by `carry.py` in the same folder; their headers list the sources.
static ROS1: LazyLock<CarriedTypes> = LazyLock::new(|| carried(include_str!("ros1.msg")));
static ROS2: LazyLock<CarriedTypes> = LazyLock::new(|| carried(include_str!("ros2.msg")));

type CarriedTypes = Vec<(Arc<MessageFields>, bool)>;

fn carried(text: &str) -> CarriedTypes {
    let all = definition::messages(text, "").unwrap_or_default();
    let named = all.into_iter().skip(1).map(|mut message| {
        let name = message.name.strip_suffix(BEFORE).map(str::to_owned);
        let is_older = name.is_some();
        message.name = name.unwrap_or(message.name);
        (Arc::new(message), is_older)
    });
    named.collect()
}

/// The types of a `.msg` or `.idl` file.
fn of_file(name: &str, path: &Path, text: &str) -> Result<Vec<MessageFields>, String> {
    let is_idl = idl::is_idl(text);
    if path.extension().is_some_and(|end| end == "idl") && !is_idl {
        return Err("it has no `module` with a `struct`".to_owned());
    }
    match definition::unreadable(text).filter(|_| !is_idl) {
        Some((number, line)) => Err(format!(
            "`{}` is not a field in line {number}",
            visible(line)
        )),
        None => definition::messages(text, name),
    }
}

impl KnownTypes {
    /// Adds the type `name`, `my_msgs/Thing`, by the text of its `.msg` or `.idl` file, or the reason why there is none. One
    /// that cannot be used is an error of the messages that need it; `path` names it.
    pub(crate) fn add(&mut self, name: &str, path: &Path, text: Result<String, String>) {
        let all = text.and_then(|text| {
            let all = of_file(name, path, &text);
            all.map_err(|reason| format!("`{}`: {reason}", path.display()))
        });
        let all = all.unwrap_or_else(|reason| vec![MessageFields::malformed(name, reason)]);
        self.own.extend(all.into_iter().map(Arc::new));
    }

    /// All types. The first match is used.
    pub(super) fn all(&self, carried: Carried) -> Vec<&Arc<MessageFields>> {
        let built_in = match carried {
            Carried::Ros1 => &ROS1,
            Carried::Ros2 | Carried::OlderRos2 => &ROS2,
        };
        let mut all: Vec<&Arc<MessageFields>> = self.own.iter().collect();
        for is_older in [true, false] {
            if !is_older || carried == Carried::OlderRos2 {
                all.extend(built_in.iter().filter(|t| t.1 == is_older).map(|t| &t.0));
            }
        }
        all
    }
}
