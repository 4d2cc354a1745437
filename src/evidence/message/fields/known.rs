//! Message types that bags name and may not define: those of ROS 2's common packages, and those of the user's own files.
//!
//! Recordings of rosbag2 in sqlite3 hold no definitions before ROS 2 Iron.

use std::sync::{Arc, LazyLock};

use super::definition::{self, MessageFields};

/// The fields of the types of common packages; `carry.py` beside it makes it, and its head names the sources.
const CARRIED: &str = include_str!("ros2.msg");
/// Behind the name of a type: its fields before they changed.
const BEFORE: &str = " before";

/// Types by package and name, the user's own first.
#[derive(Clone, Debug, Default)]
pub(crate) struct KnownTypes {
    own: Vec<Arc<MessageFields>>,
}

/// The types that we carry: each with whether it is as it was before.
static OF_ROS2: LazyLock<Vec<(Arc<MessageFields>, bool)>> = LazyLock::new(|| {
    let all = definition::messages(CARRIED, "").unwrap_or_default();
    let named = all.into_iter().skip(1).map(|mut message| {
        let name = message.name.strip_suffix(BEFORE).map(str::to_owned);
        let is_older = name.is_some();
        message.name = name.unwrap_or(message.name);
        (Arc::new(message), is_older)
    });
    named.collect()
});

impl KnownTypes {
    /// Adds the type `name`, `my_msgs/Thing`, by the text of its `.msg` file.
    ///
    /// # Errors
    /// The reason why the text cannot be used.
    pub(crate) fn add(&mut self, name: &str, text: &str) -> Result<(), String> {
        let mut messages = definition::messages(text, name)?;
        self.own.push(Arc::new(messages.swap_remove(0)));
        Ok(())
    }

    /// All types, as they were before they changed if so asked.
    pub(super) fn all(&self, is_older: bool) -> Vec<&Arc<MessageFields>> {
        let mut all: Vec<&Arc<MessageFields>> = self.own.iter().collect();
        // What comes first is found first.
        if is_older {
            all.extend(OF_ROS2.iter().filter(|(_, older)| *older).map(|(m, _)| m));
        }
        all.extend(OF_ROS2.iter().filter(|(_, older)| !older).map(|(m, _)| m));
        all
    }
}
