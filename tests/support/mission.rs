//! The ROS 2 mission of `examples/`: two minutes of a small delivery robot, described message by message.

#![expect(
    clippy::cast_possible_truncation,
    clippy::cast_possible_wrap,
    clippy::cast_sign_loss,
    reason = "two minutes in nanoseconds fit everywhere"
)]

use std::fmt::Write as _;

use super::cdr::Cdr;
use super::{ORIGIN, Recording};

const SECOND: i64 = 1_000_000_000;

/// Definitions as rosbag2 stores them, without comments.
const DEFINITIONS: &[(&str, &str)] = &[
    (
        "rcl_interfaces/msg/Log",
        "builtin_interfaces/Time stamp\nuint8 level\nstring name\nstring msg\nstring file\nstring function\nuint32 line\n",
    ),
    (
        "rcl_interfaces/msg/ParameterEvent",
        "builtin_interfaces/Time stamp\nstring node\nParameter[] new_parameters\nParameter[] changed_parameters\nParameter[] deleted_parameters\n",
    ),
    (
        "rcl_interfaces/msg/Parameter",
        "string name\nParameterValue value\n",
    ),
    (
        "rcl_interfaces/msg/ParameterValue",
        "uint8 type\nbool bool_value\nint64 integer_value\nfloat64 double_value\nstring string_value\nbyte[] byte_array_value\nbool[] bool_array_value\nint64[] integer_array_value\nfloat64[] double_array_value\nstring[] string_array_value\n",
    ),
    (
        "lifecycle_msgs/msg/TransitionEvent",
        "uint64 timestamp\nTransition transition\nState start_state\nState goal_state\n",
    ),
    ("lifecycle_msgs/msg/Transition", "uint8 id\nstring label\n"),
    ("lifecycle_msgs/msg/State", "uint8 id\nstring label\n"),
    ("builtin_interfaces/msg/Time", "int32 sec\nuint32 nanosec\n"),
    (
        "std_msgs/msg/Header",
        "builtin_interfaces/Time stamp\nstring frame_id\n",
    ),
    ("std_msgs/msg/String", "string data\n"),
    (
        "sensor_msgs/msg/LaserScan",
        "std_msgs/Header header\nfloat32 angle_min\nfloat32 angle_max\nfloat32 angle_increment\nfloat32 time_increment\nfloat32 scan_time\nfloat32 range_min\nfloat32 range_max\nfloat32[] ranges\nfloat32[] intensities\n",
    ),
    (
        "sensor_msgs/msg/Imu",
        "std_msgs/Header header\ngeometry_msgs/Quaternion orientation\nfloat64[9] orientation_covariance\ngeometry_msgs/Vector3 angular_velocity\nfloat64[9] angular_velocity_covariance\ngeometry_msgs/Vector3 linear_acceleration\nfloat64[9] linear_acceleration_covariance\n",
    ),
    (
        "nav_msgs/msg/Odometry",
        "std_msgs/Header header\nstring child_frame_id\ngeometry_msgs/PoseWithCovariance pose\ngeometry_msgs/TwistWithCovariance twist\n",
    ),
    (
        "geometry_msgs/msg/PoseWithCovariance",
        "Pose pose\nfloat64[36] covariance\n",
    ),
    (
        "geometry_msgs/msg/TwistWithCovariance",
        "Twist twist\nfloat64[36] covariance\n",
    ),
    (
        "geometry_msgs/msg/PoseWithCovarianceStamped",
        "std_msgs/Header header\nPoseWithCovariance pose\n",
    ),
    (
        "geometry_msgs/msg/Pose",
        "Point position\nQuaternion orientation\n",
    ),
    (
        "geometry_msgs/msg/PoseStamped",
        "std_msgs/Header header\nPose pose\n",
    ),
    (
        "geometry_msgs/msg/Point",
        "float64 x\nfloat64 y\nfloat64 z\n",
    ),
    (
        "geometry_msgs/msg/Quaternion",
        "float64 x\nfloat64 y\nfloat64 z\nfloat64 w\n",
    ),
    (
        "geometry_msgs/msg/Vector3",
        "float64 x\nfloat64 y\nfloat64 z\n",
    ),
    (
        "geometry_msgs/msg/Twist",
        "Vector3 linear\nVector3 angular\n",
    ),
    (
        "geometry_msgs/msg/Transform",
        "Vector3 translation\nQuaternion rotation\n",
    ),
    (
        "geometry_msgs/msg/TransformStamped",
        "std_msgs/Header header\nstring child_frame_id\nTransform transform\n",
    ),
    (
        "tf2_msgs/msg/TFMessage",
        "geometry_msgs/TransformStamped[] transforms\n",
    ),
    (
        "nav_msgs/msg/Path",
        "std_msgs/Header header\ngeometry_msgs/PoseStamped[] poses\n",
    ),
];

/// The definition of a type with those of all nested types.
pub fn definition(type_name: &str) -> String {
    let mut parts = vec![type_name.to_owned()];
    let mut at = 0;
    let mut text = String::new();
    while at < parts.len() {
        let own = DEFINITIONS
            .iter()
            .find(|(name, _)| *name == parts[at])
            .unwrap()
            .1;
        if at > 0 {
            let _ = write!(
                text,
                "{}\nMSG: {}\n",
                "=".repeat(80),
                parts[at].replacen("/msg/", "/", 1)
            );
        }
        text += own;
        for (name, _) in DEFINITIONS {
            let short = name.rsplit('/').next().unwrap();
            let inside = own.lines().filter_map(|l| l.split(' ').next());
            let mut inside =
                inside.map(|kind| kind.split('[').next().unwrap().rsplit('/').next().unwrap());
            if inside.any(|kind| kind == short) && !parts.iter().any(|p| p == name) {
                parts.push((*name).to_owned());
            }
        }
        at += 1;
    }
    text
}

/// `offered_qos_profiles` of this many publishers, as Jazzy writes it.
fn qos(publishers: usize, depth: u32, durability: &str) -> String {
    let endless = "\n    sec: 9223372036\n    nsec: 854775807";
    format!(
        "- history: keep_last\n  depth: {depth}\n  reliability: reliable\n  durability: {durability}\n  deadline:{endless}\n  \
         lifespan:{endless}\n  liveliness: automatic\n  liveliness_lease_duration:{endless}\n  \
         avoid_ros_namespace_conventions: false\n"
    )
    .repeat(publishers)
}

struct Mission {
    bag: Recording,
    rosout: usize,
    parameters: usize,
}

impl Mission {
    fn topic(&mut self, node: &str, topic: &str, type_name: &str) -> usize {
        let place = self.bag.publisher(node, topic, type_name);
        let publisher = &mut self.bag.publishers[place];
        publisher.qos = qos(1, 10, "volatile");
        publisher.definition = definition(type_name);
        place
    }

    /// A topic with transient local durability.
    fn kept(&mut self, node: &str, topic: &str, type_name: &str) -> usize {
        let place = self.topic(node, topic, type_name);
        self.bag.publishers[place].qos = qos(1, 1, "transient_local");
        place
    }

    /// Publishes `payload` of each time, `hz` times per second, between two times in seconds.
    fn stream(
        &mut self,
        topic: usize,
        (from, to): (f64, f64),
        hz: f64,
        payload: impl Fn(i64) -> Vec<u8>,
    ) {
        let count = ((to - from) * hz) as i64;
        for i in 0..count {
            // Recorders receive messages with a varying delay.
            let jitter = (i * 7919 + topic as i64 * 104_729) % 3_000_000;
            let at = ORIGIN + (from * 1e9) as i64 + (i as f64 / hz * 1e9) as i64 + jitter;
            self.bag.messages.push((topic, at, payload(at - jitter)));
        }
    }

    fn log(&mut self, node: &str, second: f64, level: u8, text: &str) {
        let at = ORIGIN + (second * 1e9) as i64;
        let name = node.trim_start_matches('/').replace('/', ".");
        let payload = Cdr::default().time(at).u8(level).text(&name).text(text);
        let file = format!("{}_node.cpp", name.rsplit('.').next().unwrap_or_default());
        let payload = payload.text(&file).text("run").u32(42).done();
        self.bag.messages.push((self.rosout, at + 400_000, payload));
    }

    /// Starts a node: it declares a parameter and logs its start.
    fn start(&mut self, node: &str, second: f64) {
        let at = ORIGIN + (second * 1e9) as i64;
        let empty = |cdr: Cdr| (0..5).fold(cdr.text(""), |cdr, _| cdr.u32(0));
        let event = Cdr::default()
            .time(at)
            .text(node)
            .u32(1)
            .text("use_sim_time")
            .u8(1)
            .u8(0)
            .u64(0)
            .f64(0.0);
        let event = empty(event).u32(0).u32(0).done();
        self.bag.messages.push((self.parameters, at, event));
        self.log(node, second + 0.05, 20, "up");
    }

    /// A lifecycle node's change of state.
    fn transition(
        &mut self,
        topic: usize,
        second: f64,
        (id, label): (u8, &str),
        from: (u8, &str),
        to: (u8, &str),
    ) {
        let at = ORIGIN + (second * 1e9) as i64;
        let event = Cdr::default().u64(at as u64).u8(id).text(label);
        let event = event.u8(from.0).text(from.1).u8(to.0).text(to.1).done();
        self.bag.messages.push((topic, at, event));
    }
}

fn scan(at: i64) -> Vec<u8> {
    let phase = (at / SECOND % 60) as f32;
    let ranges: Vec<f32> = (0..60)
        .map(|i| 2.0 + ((i * 7) % 13) as f32 * 0.25 + phase * 0.01)
        .collect();
    let head = Cdr::default()
        .header(at, "laser")
        .f32(-1.57)
        .f32(1.57)
        .f32(0.052);
    head.f32(0.0)
        .f32(0.2)
        .f32(0.1)
        .f32(12.0)
        .f32s(&ranges)
        .f32s(&[])
        .done()
}

fn many(cdr: Cdr, count: usize, value: f64) -> Cdr {
    (0..count).fold(cdr, |cdr, _| cdr.f64(value))
}

fn pose(cdr: Cdr, at: i64) -> Cdr {
    let seconds = (at - ORIGIN) as f64 / 1e9;
    cdr.f64(seconds * 0.2)
        .f64(seconds * 0.05)
        .f64(0.0)
        .f64(0.0)
        .f64(0.0)
        .f64(0.0)
        .f64(1.0)
}

fn imu(at: i64) -> Vec<u8> {
    let cdr = many(Cdr::default().header(at, "imu"), 3, 0.0).f64(1.0);
    let cdr = many(many(cdr, 9, 0.01), 3, 0.001);
    let cdr = many(many(cdr, 9, 0.01), 2, 0.02).f64(9.81);
    many(cdr, 9, 0.04).done()
}

fn odometry(at: i64) -> Vec<u8> {
    let cdr = pose(Cdr::default().header(at, "odom").text("base_link"), at);
    let cdr = many(many(cdr, 36, 0.001), 1, 0.2);
    many(many(cdr, 5, 0.0), 36, 0.001).done()
}

fn estimate(at: i64) -> Vec<u8> {
    many(pose(Cdr::default().header(at, "map"), at), 36, 0.05).done()
}

fn transform(parent: &'static str, child: &'static str) -> impl Fn(i64) -> Vec<u8> {
    move |at| pose(Cdr::default().u32(1).header(at, parent).text(child), at).done()
}

fn path(at: i64) -> Vec<u8> {
    let cdr = Cdr::default().header(at, "map").u32(8);
    (0..8)
        .fold(cdr, |cdr, i| pose(cdr.header(at, "map"), at + i * SECOND))
        .done()
}

fn twist(forward: f64) -> impl Fn(i64) -> Vec<u8> {
    move |_| many(many(Cdr::default(), 1, forward), 5, 0.0).done()
}

fn words(text: &'static str) -> impl Fn(i64) -> Vec<u8> {
    move |_| Cdr::default().text(text).done()
}

const UNCONFIGURED: (u8, &str) = (1, "unconfigured");
const INACTIVE: (u8, &str) = (2, "inactive");
const ACTIVE: (u8, &str) = (3, "active");

/// The mission. The README of `examples/` describes it minute by minute.
pub fn mission() -> Recording {
    let mut m = Mission {
        bag: Recording::default(),
        rosout: 0,
        parameters: 0,
    };
    m.rosout = m.topic("", "/rosout", "rcl_interfaces/msg/Log");
    m.bag.publishers[m.rosout].qos = qos(9, 1000, "transient_local");
    m.parameters = m.topic("", "/parameter_events", "rcl_interfaces/msg/ParameterEvent");
    m.bag.publishers[m.parameters].qos = qos(9, 1000, "volatile");
    base(&mut m);
    navigation(&mut m);
    delivery(&mut m);
    m.bag.messages.sort_by_key(|message| message.1);
    m.bag
}

/// The robot itself: present throughout, except for the lidar, which is silent for a while.
fn base(m: &mut Mission) {
    for node in [
        "/base_driver",
        "/lidar",
        "/imu_driver",
        "/robot_state_publisher",
    ] {
        m.start(node, 0.2);
    }
    let description = m.kept(
        "/robot_state_publisher",
        "/robot_description",
        "std_msgs/msg/String",
    );
    m.stream(
        description,
        (0.3, 1.3),
        1.0,
        words("<robot name=\"courier\"/>"),
    );
    let fixed = m.kept(
        "/robot_state_publisher",
        "/tf_static",
        "tf2_msgs/msg/TFMessage",
    );
    m.stream(fixed, (0.3, 1.3), 1.0, transform("base_link", "laser"));
    let odom = m.topic("/base_driver", "/odom", "nav_msgs/msg/Odometry");
    m.stream(odom, (0.5, 120.0), 2.0, odometry);
    let tf = m.topic("/base_driver", "/tf", "tf2_msgs/msg/TFMessage");
    m.bag.publishers[tf].qos = qos(2, 100, "volatile");
    m.stream(tf, (0.5, 120.0), 5.0, transform("odom", "base_link"));
    let imu_data = m.topic("/imu_driver", "/imu", "sensor_msgs/msg/Imu");
    m.stream(imu_data, (0.5, 120.0), 5.0, imu);
    let scan_data = m.topic("/lidar", "/scan", "sensor_msgs/msg/LaserScan");
    m.stream(scan_data, (0.5, 70.0), 5.0, scan);
    m.log("/lidar", 70.0, 40, "no data from the sensor");
    m.log("/lidar", 78.0, 20, "the sensor is back");
    m.stream(scan_data, (78.0, 120.0), 5.0, scan);
}

/// Localisation and planning: started one after the other, stopped before the end.
fn navigation(m: &mut Mission) {
    m.start("/amcl", 10.0);
    let estimated = m.topic(
        "/amcl",
        "/amcl_pose",
        "geometry_msgs/msg/PoseWithCovarianceStamped",
    );
    m.stream(estimated, (11.0, 120.0), 1.0, estimate);
    let tf = m.topic("/amcl", "/tf", "tf2_msgs/msg/TFMessage");
    m.stream(tf, (11.0, 120.0), 2.0, transform("map", "odom"));
    m.start("/nav/planner", 20.0);
    let event = "lifecycle_msgs/msg/TransitionEvent";
    let state = m.topic("/nav/planner", "/nav/planner/transition_event", event);
    m.transition(state, 20.5, (1, "configure"), UNCONFIGURED, INACTIVE);
    m.transition(state, 22.0, (3, "activate"), INACTIVE, ACTIVE);
    m.log("/nav/planner", 22.1, 20, "activating");
    let plan = m.topic("/nav/planner", "/plan", "nav_msgs/msg/Path");
    m.stream(plan, (23.0, 60.0), 1.0, path);
    m.stream(plan, (60.0, 100.0), 0.25, path);
    m.transition(state, 101.0, (4, "deactivate"), ACTIVE, INACTIVE);
    m.log("/nav/planner", 101.1, 20, "deactivating");
    m.start("/nav/controller", 24.0);
    let command = m.topic("/nav/controller", "/cmd_vel", "geometry_msgs/msg/Twist");
    m.bag.publishers[command].qos = qos(2, 10, "volatile");
    m.stream(command, (25.0, 50.0), 10.0, twist(0.4));
    m.stream(command, (65.0, 100.0), 10.0, twist(0.3));
}

/// Manual control of the robot, and delivery of a parcel.
fn delivery(m: &mut Mission) {
    m.start("/teleop", 48.0);
    let command = m.topic("/teleop", "/cmd_vel", "geometry_msgs/msg/Twist");
    m.stream(command, (50.0, 65.0), 5.0, twist(0.1));
    m.log("/teleop", 66.0, 20, "released");
    m.start("/gripper", 85.0);
    let gripper = m.topic("/gripper", "/gripper/state", "std_msgs/msg/String");
    m.stream(gripper, (86.0, 118.0), 2.0, words("open"));
    m.start("/docking", 102.0);
    let docking = m.topic(
        "/docking",
        "/dock_pose",
        "geometry_msgs/msg/PoseWithCovarianceStamped",
    );
    m.stream(docking, (103.0, 119.0), 2.0, estimate);
    let command = m.topic("/docking", "/cmd_vel", "geometry_msgs/msg/Twist");
    m.stream(command, (104.0, 118.0), 5.0, twist(0.05));
    m.log("/docking", 118.5, 20, "docked");
}
