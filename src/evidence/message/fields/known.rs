//! Message types that bags may use without definition: those of ROS's common packages, and those in the user's files.
//!
//! rosbag2's sqlite3 recordings contain no definitions before ROS 2 Iron.

use std::path::Path;
use std::sync::{Arc, LazyLock};

use super::text::{self, Form, MessageFields};

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
    let all = text::messages(text, "", Form::Msg).unwrap_or_default();
    let named = all.into_iter().skip(1).map(|mut message| {
        let name = message.name.strip_suffix(BEFORE).map(str::to_owned);
        let is_older = name.is_some();
        message.name = name.unwrap_or(message.name);
        (Arc::new(message), is_older)
    });
    named.collect()
}

impl KnownTypes {
    /// Adds the types of the file of `name`, `my_msgs/Thing`, by its text, or the reason why there is none. One that cannot
    /// be used is an error of the messages that need it; `path` names it.
    pub(crate) fn add(&mut self, name: &str, path: &Path, text: Result<String, String>) {
        let end = path.extension().unwrap_or_default().to_string_lossy();
        let form = Form::named(&end.to_uppercase()).unwrap_or(Form::Msg);
        let all = text.and_then(|text| text::messages(&text, name, form));
        // The file of a service or an action defines no message of its own name.
        let all = all.map(|all| {
            all.into_iter()
                .skip(usize::from(form.has_parts()))
                .collect()
        });
        let mut all: Vec<_> =
            all.unwrap_or_else(|reason| vec![MessageFields::malformed(name, reason)]);
        for reason in all.iter_mut().filter_map(|message| message.wrong.as_mut()) {
            *reason = format!("`{}`: {reason}", path.display());
        }
        self.own.extend(all.into_iter().map(Arc::new));
    }

    /// All types. The first match is used.
    pub(super) fn all(&self, carried: Carried) -> Vec<Arc<MessageFields>> {
        let built_in = match carried {
            Carried::Ros1 => &ROS1,
            Carried::Ros2 | Carried::OlderRos2 => &ROS2,
        };
        let mut all = self.own.clone();
        for is_older in [true, false] {
            if !is_older || carried == Carried::OlderRos2 {
                let version = built_in.iter().filter(|t| t.1 == is_older);
                all.extend(version.map(|t| Arc::clone(&t.0)));
            }
        }
        all
    }
}
