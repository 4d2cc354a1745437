//! Tests of source code with a bag: names from the bag, edges from the code; nothing is executed.

use std::collections::BTreeSet;
use std::fs;
use std::path::Path;
use std::process::{Command, Output};

use serde_json::Value;
use tempfile::TempDir;

use crate::support::cdr::Cdr;
use crate::support::mission::definition;
use crate::support::{ORIGIN, Recording, mcap};

/// A ROS 2 recording: these topics with their types, each with one publisher, and log records of each node; names that
/// end in `late` begin in the middle.
pub(crate) fn bag(topics: &[(&str, &str)], nodes: &[&str]) -> Vec<u8> {
    let mut bag = Recording::default();
    let rosout = bag.publisher("", "/rosout", "rcl_interfaces/msg/Log");
    bag.publishers[rosout].definition = definition("rcl_interfaces/msg/Log");
    for node in nodes {
        let name = node.trim_start_matches('/').replace('/', ".");
        let first = if name.ends_with("late") { 5 } else { 0 };
        for second in first..10 {
            let at = ORIGIN + second * 1_000_000_000;
            let log = Cdr::default().time(at).u8(20).text(&name).text("up");
            let log = log.text("x.cpp").text("f").u32(1).done();
            bag.messages.push((rosout, at, log));
        }
    }
    for (topic, type_name) in topics {
        let place = bag.publisher("", topic, type_name);
        bag.publishers[place]
            .qos
            .push_str("- history: 1\n  depth: 10\n  reliability: 1\n  durability: 2\n");
        let first = if topic.ends_with("late") { 5_000 } else { 0 };
        bag.send(place, (first, 10_000), 500, &[0, 1, 0, 0, 1, 2, 3, 4]);
    }
    bag.messages.sort_by_key(|m| m.1);
    let options = mcap::Options {
        profile: "ros2",
        ..mcap::Options::default()
    };
    mcap::write(&bag, &options)
}

/// A folder with a bag and a workspace of these files.
fn folder(topics: &[(&str, &str)], nodes: &[&str], files: &[(&str, &str)]) -> TempDir {
    let folder = TempDir::new().unwrap();
    fs::write(folder.path().join("run.mcap"), bag(topics, nodes)).unwrap();
    put(&folder.path().join("ws"), files);
    folder
}

fn put(workspace: &Path, files: &[(&str, &str)]) {
    for (path, text) in files {
        let path = workspace.join(path);
        fs::create_dir_all(path.parent().unwrap()).unwrap();
        fs::write(path, text).unwrap();
    }
}

fn bagreel(folder: &Path, words: &[&str]) -> Output {
    let mut command = Command::new(env!("CARGO_BIN_EXE_bagreel"));
    command.current_dir(folder).args(words).output().unwrap()
}

/// Every edge that `info` lists with the workspace, as `node -> topic` or `topic -> node`; log topics left
/// out.
fn edges(folder: &Path, more: &[&str]) -> BTreeSet<String> {
    let words = [
        &["info", "run.mcap", "--format", "json", "--source", "ws"],
        more,
    ]
    .concat();
    let output = bagreel(folder, &words);
    assert!(
        output.status.success(),
        "{}",
        String::from_utf8_lossy(&output.stderr)
    );
    let info: Value = serde_json::from_slice(&output.stdout).unwrap();
    let mut edges = BTreeSet::new();
    for topic in info["topics"].as_array().unwrap() {
        let name = topic["name"].as_str().unwrap();
        let all = |key: &str| topic[key].as_array().unwrap().clone();
        if name != "/rosout" {
            edges.extend(
                all("publishers")
                    .iter()
                    .map(|n| format!("{} -> {name}", n.as_str().unwrap())),
            );
            edges.extend(
                all("subscribers")
                    .iter()
                    .map(|n| format!("{name} -> {}", n.as_str().unwrap())),
            );
        }
    }
    edges
}

fn set(edges: &[&str]) -> BTreeSet<String> {
    edges.iter().map(|e| (*e).to_owned()).collect()
}

pub(crate) const STRING: &str = "std_msgs/msg/String";
pub(crate) const PACKAGE: (&str, &str) = ("p/package.xml", "<package><name>p</name></package>");

/// A node in Python that publishes one topic and subscribes to another.
pub(crate) fn node(name: &str, publishes: &str, subscribes: &str) -> String {
    format!(
        "from std_msgs.msg import String\nclass N(Node):\n    def __init__(self):\n        super().__init__('{name}')\n        \
         self.create_publisher(String, '{publishes}', 1)\n        \
         self.create_subscription(String, '{subscribes}', self.cb, 1)\n\ndef main():\n    rclpy.spin(N())\n"
    )
}

#[test]
fn names_come_from_the_bag_and_edges_from_the_code() {
    let folder = folder(
        &[
            ("/out", STRING),
            ("/in", STRING),
            ("/number", "std_msgs/msg/Int8"),
        ],
        &["/talker"],
        &[
            PACKAGE,
            ("p/p/talker.py", &node("talker", "out", "/in")),
            // This node is not in the bag, and this topic has another type.
            ("p/p/other.py", &node("other", "out", "number")),
        ],
    );
    assert_eq!(
        edges(folder.path(), &[]),
        set(&["/talker -> /out", "/in -> /talker"])
    );
}

#[test]
fn a_launch_file_names_the_node_and_remaps_its_topics() {
    let launch = "def generate_launch_description():\n    return LaunchDescription([Node(package='p', executable='run', name='front',\n        \
                  namespace='r1', remappings=[('out', 'lidar'), ('/in', 'go')])])\n";
    let setup = "setup(entry_points={'console_scripts': ['run = p.talker:main']})";
    let folder = folder(
        &[("/r1/lidar", STRING), ("/r1/go", STRING), ("/in", STRING)],
        &["/r1/front"],
        &[
            PACKAGE,
            ("p/setup.py", setup),
            ("p/launch/all.launch.py", launch),
            ("p/p/talker.py", &node("talker", "out", "/in")),
        ],
    );
    assert_eq!(
        edges(folder.path(), &[]),
        set(&["/r1/front -> /r1/lidar", "/r1/go -> /r1/front"])
    );
    let why = bagreel(
        folder.path(),
        &[
            "info",
            "run.mcap",
            "--source",
            "ws",
            "--why",
            "/r1/front",
            "/r1/lidar",
        ],
    );
    let text = String::from_utf8_lossy(&why.stdout).replace("\\'", "'");
    assert!(
        text.contains(
            "p/p/talker.py:5  create_publisher(String, 'out', 1); the node is named by rosout"
        ),
        "{text}"
    );
    assert!(
        text.contains("launched at p/launch/all.launch.py:2"),
        "{text}"
    );
}

#[test]
fn cpp_classes_are_found_through_cmake_headers_and_bases() {
    let folder = folder(
        &[("/out", STRING), ("/help", STRING), ("/base", STRING)],
        &["/renamed"],
        &[
            PACKAGE,
            ("p/CMakeLists.txt", "add_executable(exe src/main.cpp)\n"),
            (
                "p/src/main.cpp",
                "#include \"arm.hpp\"\nint main() { rclcpp::spin(std::make_shared<Arm>()); }",
            ),
            (
                "p/src/arm.cpp",
                "Arm::Arm() : Base(\"arm\") { pub_ = create_publisher<std_msgs::msg::String>(\"out\", 1); helper_ = Helper(this); }",
            ),
            (
                "p/include/arm.hpp",
                "class Arm : public Base { Arm(); Helper helper_; };",
            ),
            (
                "p/include/helper.hpp",
                "class Helper { Helper(rclcpp::Node* n) { n->create_subscription<std_msgs::msg::String>(\"help\", 1, cb); } };",
            ),
            (
                "p/include/base.hpp",
                "class Base : public rclcpp::Node { Base(std::string n) : Node(n) { create_publisher<std_msgs::msg::String>(\"base\", 1); } };",
            ),
            (
                "p/launch/x.launch.xml",
                "<launch><node pkg=\"p\" exec=\"exe\" name=\"renamed\"/></launch>",
            ),
        ],
    );
    let expected = set(&["/renamed -> /out", "/help -> /renamed", "/renamed -> /base"]);
    assert_eq!(edges(folder.path(), &[]), expected);
}

#[test]
fn among_programs_of_one_name_the_one_with_recorded_topics_counts() {
    let folder = folder(
        &[("/a", STRING), ("/b", STRING), ("/c", STRING)],
        &["/n"],
        &[
            PACKAGE,
            ("p/p/old.py", &node("n", "a", "gone")),
            ("p/p/new.py", &node("n", "b", "c")),
            ("p/test/test_n.py", &node("n", "a", "b")),
        ],
    );
    assert_eq!(edges(folder.path(), &[]), set(&["/n -> /b", "/c -> /n"]));
}

/// Any code of the workspace that bagreel executes would leave a file.
#[cfg(unix)]
#[test]
fn a_hostile_workspace_executes_nothing() {
    use std::os::unix::fs::PermissionsExt as _;
    let folder = folder(
        &[("/out", STRING)],
        &["/n"],
        &[PACKAGE, ("p/p/n.py", &node("n", "out", "x"))],
    );
    let workspace = folder.path().join("ws");
    let trap = folder.path().join("trap");
    fs::write(
        &trap,
        format!("#!/bin/sh\ntouch {}/sprung\n", folder.path().display()),
    )
    .unwrap();
    fs::set_permissions(&trap, fs::Permissions::from_mode(0o755)).unwrap();
    let trap_path = trap.display().to_string();
    std::os::unix::fs::symlink("/etc", workspace.join("out")).unwrap();
    let cmake = format!("execute_process(COMMAND {trap_path})\n");
    let python = format!("import os\nos.system('{trap_path}')\n");
    let launch = format!(
        "{python}def generate_launch_description():\n    os.system('{trap_path}')\n    return LaunchDescription([])\n"
    );
    let macros = "#define A(x) A(A(x))\n".repeat(5000) + &"A(".repeat(20_000);
    let git = format!("[core]\n    fsmonitor = {trap_path}\n");
    let files = [
        ("p/CMakeLists.txt", cmake.as_str()),
        ("p/setup.py", &python),
        ("p/x.launch.py", &launch),
        ("p/a.cpp", &macros),
        (".git/config", &git),
    ];
    put(&workspace, &files);
    assert_eq!(edges(folder.path(), &[]), set(&["/n -> /out"]));
    assert!(!folder.path().join("sprung").exists(), "something was run");
}

/// The output of `info` with the workspace, on both streams.
fn said(folder: &Path, more: &[&str]) -> String {
    let output = bagreel(
        folder,
        &[&["info", "run.mcap", "--source", "ws"], more].concat(),
    );
    assert!(output.status.success());
    [output.stdout, output.stderr]
        .map(|text| String::from_utf8_lossy(&text).into_owned())
        .concat()
}

#[test]
fn the_only_possible_declaration_is_inferred_on_request() {
    let folder = folder(
        &[("/out", STRING), ("/in", STRING)],
        &[],
        &[PACKAGE, ("p/p/talker.py", &node("talker", "out", "in"))],
    );
    assert_eq!(edges(folder.path(), &[]), set(&[]));
    let text = said(folder.path(), &[]);
    assert!(
        text.contains(
            "/talker publishes /out (p/p/talker.py:5  create_publisher(String, 'out', 1))"
        ),
        "{text}"
    );
    assert!(
        text.contains("`--infer source` draws it") && text.contains("2 places not drawn"),
        "{text}"
    );
    let inferred = set(&["/talker ? -> /out", "/in -> /talker ?"]);
    assert_eq!(edges(folder.path(), &["--infer", "source"]), inferred);
    let text = said(folder.path(), &["--infer", "source"]);
    assert!(
        text.contains("0 nodes, 0 publications, 0 subscriptions"),
        "{text}"
    );
    let events = bagreel(
        folder.path(),
        &["events", "run.mcap", "--source", "ws", "--infer", "source"],
    );
    assert!(
        !String::from_utf8_lossy(&events.stdout).contains("talker"),
        "{events:?}"
    );
}

#[test]
fn reasons_against_a_declaration_are_reported() {
    let logging = node("talker", "out", "in").replace(
        "        self.create_pub",
        "        self.get_logger().info('x')\n        self.create_pub",
    );
    let many = node("talker", "out", "in")
        + &"        self.create_publisher(String, 'x', 1)\n".replace('x', "y");
    let many = many.replace("def main", "class M(Node):\n    def __init__(self):\n        super().__init__('m')\n        self.create_publisher(String, 'out', 1)\n\ndef main");
    let few = node("talker", "out", "gone").replace(
        "\n\ndef",
        "\n        self.create_publisher(String, 'more', 1)\n\ndef",
    );
    for (nodes, code, says) in [
        (&["/other"][..], &logging, "its node would have logged"),
        (&[], &many, "several declarations match"),
        (&[], &few, "most of its node's topics are not in the bag"),
    ] {
        let folder = folder(
            &[("/out", STRING), ("/in", STRING)],
            nodes,
            &[PACKAGE, ("p/p/talker.py", code)],
        );
        let found = edges(folder.path(), &["--infer", "source"]);
        assert!(!found.contains("/talker ? -> /out"), "{says}: {found:?}");
        let text = said(folder.path(), &["--infer", "source"]);
        assert!(text.contains(says), "{says}: {text}");
        // A node that may not have run has no certain subscriptions.
        if says.starts_with("several") {
            assert!(found.is_empty(), "{found:?}");
            let why = "the topics of its node may have another publisher";
            assert!(text.contains(why), "{text}");
        }
    }
}

#[test]
fn all_edges_of_a_node_that_did_not_run_are_left_out() {
    let talker = node("talker", "out", "in");
    let other_type = talker.replace(
        "\n\ndef",
        "\n        self.create_publisher(String, 'number', 1)\n\ndef",
    );
    let old = "import rospy\nfrom std_msgs.msg import String\nrospy.init_node('talker')\n\
               rospy.Publisher('out', String)\nrospy.Subscriber('in', String, cb)\n";
    let publisher = node("boss", "out", "gone");
    for (nodes, boss, code, says) in [
        (
            &["/boss"][..],
            &*publisher,
            &*talker,
            "the topics of its node may have another publisher",
        ),
        (
            &[],
            "",
            &other_type,
            "a topic of its node has another type in the bag",
        ),
        (&[], "", old, "its node is for the other version of ROS"),
    ] {
        let topics = [
            ("/out", STRING),
            ("/in", STRING),
            ("/number", "std_msgs/msg/Int8"),
        ];
        let files = [PACKAGE, ("p/p/talker.py", code), ("p/p/boss.py", boss)];
        let folder = folder(&topics, nodes, &files);
        let found = edges(folder.path(), &["--infer", "source"]);
        assert!(
            !found.iter().any(|edge| edge.contains("talker")),
            "{says}: {found:?}"
        );
        let text = said(folder.path(), &["--infer", "source"]);
        assert!(text.contains(says), "{says}: {text}");
    }
}

#[test]
fn topics_without_a_slash_from_a_custom_writer_are_at_the_root() {
    let files = [PACKAGE, ("p/p/talker.py", &*node("talker", "out", "in"))];
    let folder = folder(&[("out", STRING), ("/in", STRING)], &["/talker"], &files);
    assert_eq!(
        edges(folder.path(), &[]),
        set(&["/talker -> out", "/in -> /talker"])
    );
}

#[test]
fn a_node_of_a_launch_file_takes_its_edges_from_the_code_once() {
    let files = [PACKAGE, ("p/p/talker.py", &*node("talker", "out", "in"))];
    let folder = folder(&[("/out", STRING), ("/in", STRING)], &[], &files);
    let launch = r#"<launch><node pkg="p" exec="talker" name="talker"/></launch>"#;
    fs::write(folder.path().join("all.launch.xml"), launch).unwrap();
    let more = ["--infer", "source", "--topology", "all.launch.xml"];
    assert_eq!(
        edges(folder.path(), &more),
        set(&["/talker -> /out", "/in -> /talker"])
    );
}

#[test]
fn types_owned_by_another_program_are_not_inferred() {
    let code = node("fake", "turtle1/pose", "in")
        .replace("std_msgs.msg import String", "turtlesim.msg import Pose")
        .replace("create_publisher(String", "create_publisher(Pose");
    let topics = [("/turtle1/pose", "turtlesim/msg/Pose")];
    let folder = folder(&topics, &[], &[PACKAGE, ("p/p/fake.py", &code)]);
    let text = said(folder.path(), &["--infer", "source"]);
    assert!(
        text.contains("its type belongs to another program"),
        "{text}"
    );
    let found = edges(folder.path(), &["--infer", "source"]);
    assert!(!found.contains("/fake ? -> /turtle1/pose"), "{found:?}");
}

#[test]
fn a_simulation_is_rejected_if_another_launch_file_starts_the_same_nodes() {
    let launch = |nodes: &[&str]| {
        let node = |n: &&str| format!("Node(package='p', executable='{n}', name='{n}')");
        let nodes: Vec<String> = nodes.iter().map(node).collect();
        let nodes = nodes.join(", ");
        format!("def generate_launch_description():\n    return LaunchDescription([{nodes}])\n")
    };
    let setup =
        "setup(entry_points={'console_scripts': ['steer = p.steer:main', 'sim = p.sim:main']})\n";
    let robot = launch(&["steer"]);
    let simulation = launch(&["steer", "sim"]);
    let (steer, sim) = (node("steer", "in", "out"), node("sim", "out", "in"));
    let files = [
        PACKAGE,
        ("p/setup.py", setup),
        ("p/p/steer.py", &steer),
        ("p/p/sim.py", &sim),
        ("p/launch/simulation.launch.py", &simulation),
        ("p/launch/robot.launch.py", &robot),
    ];
    let recorded = [("/out", STRING), ("/in", STRING)];
    let named = ["/steer -> /in", "/out -> /steer"];
    let both = folder(&recorded, &["/steer"], &files);
    assert_eq!(edges(both.path(), &["--infer", "source"]), set(&named));
    let text = said(both.path(), &["--infer", "source"]);
    assert!(
        text.contains("another launch file matches better"),
        "{text}"
    );
    let alone = folder(&recorded, &["/steer"], &files[..5]);
    let found = edges(alone.path(), &["--infer", "source"]);
    assert!(found.contains("/sim ? -> /out"), "{found:?}");
    // If the bag names no nodes, the robot or its simulation may have run.
    let neither = folder(&recorded, &[], &files);
    let shared = set(&["/steer ? -> /in", "/out -> /steer ?"]);
    assert_eq!(edges(neither.path(), &["--infer", "source"]), shared);
    let text = said(neither.path(), &["--infer", "source"]);
    let why = "a matching launch file does not start its node";
    assert!(text.contains(why), "{text}");
}

#[test]
fn remarks_about_the_code_are_listed() {
    let more = "\n        self.create_publisher(String, 'lost', 1)\n\ndef";
    let code = node("talker", "out", "in").replace("\n\ndef", more);
    let folder = folder(
        &[("/out", STRING), ("/in", "std_msgs/msg/Int8")],
        &["/talker", "/stranger"],
        &[PACKAGE, ("p/p/talker.py", &code)],
    );
    let text = said(folder.path(), &[]);
    for says in [
        "no code was found for /stranger",
        "/in is std_msgs/Int8 in the bag and std_msgs/String in the code of /talker (p/p/talker.py:6)",
        "/talker publishes /lost by its code (p/p/talker.py:7), which is not recorded: record it too",
    ] {
        assert!(text.contains(says), "{says}: {text}");
    }
}

#[test]
fn events_exclude_what_only_the_code_declares() {
    let folder = folder(
        &[("/out", STRING), ("/in", STRING)],
        &["/talker_late"],
        &[
            PACKAGE,
            ("p/p/talker.py", &node("talker_late", "out", "in")),
        ],
    );
    assert_eq!(edges(folder.path(), &[]).len(), 2);
    let events = bagreel(folder.path(), &["events", "run.mcap", "--source", "ws"]);
    let text = String::from_utf8_lossy(&events.stdout).into_owned();
    // Nothing shows that the node was absent before its log record either.
    assert!(
        text.ends_with(", nothing changed\n") && text.lines().count() == 1,
        "{text}"
    );
}

#[test]
fn inapplicable_options_are_refused() {
    let folder = folder(&[("/out", STRING)], &["/n"], &[PACKAGE]);
    fs::write(
        folder.path().join("x.json"),
        "{\"schema\": \"bagreel.mission/3\", \"windows\": []}",
    )
    .unwrap();
    for (words, says) in [
        (
            &["info", "run.mcap", "--source", "nowhere"][..],
            "cannot read `nowhere`",
        ),
        (
            &["info", "run.mcap", "--infer", "source"],
            "`--infer source` requires source code",
        ),
        (&["info", "x.json", "--source", "ws"], "is a mission's JSON"),
    ] {
        let output = bagreel(folder.path(), words);
        let said = String::from_utf8_lossy(&output.stderr).into_owned();
        assert!(
            matches!(output.status.code(), Some(1 | 2)) && said.contains(says),
            "{words:?}: {said}"
        );
    }
}
