//! A log record of ROS 1 (`rosgraph_msgs/Log`) or ROS 2 (`rcl_interfaces/msg/Log`): its logger, text and source file.

use crate::evidence::message::cursor::{PayloadCursor, PayloadResult};

/// A log record.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct LogRecord<'a> {
    /// The full name of the node, or of the logger, which is a node or a part of one.
    pub(crate) logger: String,
    pub(crate) text: &'a str,
    /// The path of the source file as recorded by the compiler or interpreter.
    pub(crate) file: &'a str,
}

impl<'a> LogRecord<'a> {
    /// Reads a whole record.
    ///
    /// # Errors
    /// If it has another layout.
    pub(crate) fn read(payload: &mut PayloadCursor<'a>) -> PayloadResult<Self> {
        let is_ros2 = payload.is_cdr();
        if is_ros2 {
            payload.time()?;
        } else {
            payload.header()?;
        }
        payload.u8()?;
        let name = payload.string()?;
        let logger = if is_ros2 && !name.is_empty() {
            format!("/{}", name.trim_start_matches('/').replace('.', "/"))
        } else {
            name.to_owned()
        };
        let (text, file) = (payload.string()?, payload.string()?);
        payload.skip_string()?;
        payload.u32()?;
        if !is_ros2 {
            for _ in 0..payload.length(4)? {
                payload.skip_string()?;
            }
        }
        payload.finish()?;
        Ok(Self { logger, text, file })
    }

    /// The source file's name without folders.
    pub(crate) fn file_name(&self) -> &'a str {
        self.file.rsplit(['/', '\\']).next().unwrap_or(self.file)
    }
}
