//! A log record of ROS 1 (`rosgraph_msgs/Log`) or ROS 2 (`rcl_interfaces/msg/Log`): its logger, text and source file.

use crate::base::name::plain_type;
use crate::evidence::message::cursor::{PayloadCursor, PayloadResult};

/// A log record.
#[derive(Default)]
pub(crate) struct LogRecord<'a> {
    /// The name of the node or logger in the record.
    pub(crate) name: &'a str,
    /// The full name of the node, or of the logger, which is a node or a part of one.
    pub(crate) logger: String,
    pub(crate) text: &'a str,
    /// The path of the source file as recorded by the compiler or interpreter.
    pub(crate) file: &'a str,
    /// The number of the record among those of its node; `None` in ROS 2.
    pub(crate) number: Option<u32>,
    /// The topics of the node, as far as roscpp and rospy list them; none in ROS 2.
    pub(crate) topics: Vec<&'a str>,
}

/// Whether a type is that of log records of ROS 1.
pub(crate) fn is_ros1_log(type_name: &str) -> bool {
    ["rosgraph_msgs/Log", "roslib/Log"].contains(&&*plain_type(type_name))
}

impl<'a> LogRecord<'a> {
    /// Reads a whole record, of ROS 1 or of ROS 2.
    ///
    /// # Errors
    /// If it has another layout.
    pub(crate) fn read(payload: &mut PayloadCursor<'a>, is_ros1: bool) -> PayloadResult<Self> {
        let number = if is_ros1 {
            payload.header()?.number
        } else {
            payload.time()?;
            None
        };
        payload.u8()?;
        let name = payload.string()?;
        let logger = if is_ros1 || name.is_empty() {
            name.to_owned()
        } else {
            format!("/{}", name.trim_start_matches('/').replace('.', "/"))
        };
        let (text, file) = (payload.string()?, payload.string()?);
        payload.skip_string()?;
        payload.u32()?;
        let listed = if is_ros1 { payload.length(4)? } else { 0 };
        let topics = (0..listed).map(|_| payload.string());
        let topics = topics.collect::<PayloadResult<_>>()?;
        payload.finish()?;
        Ok(Self {
            name,
            logger,
            text,
            file,
            number,
            topics,
        })
    }

    /// The source file's name without folders.
    pub(crate) fn file_name(&self) -> &'a str {
        self.file.rsplit(['/', '\\']).next().unwrap_or(self.file)
    }
}
