//! Tests of launch files in XML and YAML.

use super::*;

fn elements(text: &str) -> Vec<NamedElement> {
    let path = Path::new("robot.launch");
    let tree = if text.starts_with('<') {
        tree::of_xml(path, text).unwrap()
    } else {
        tree::of_yaml(path, text).unwrap().unwrap()
    };
    let entries = read(path, &tree).unwrap().entries;
    entries.into_iter().map(|e| e.element).collect()
}

#[test]
fn ros1_has_groups_arguments_conditions_and_remaps() {
    let text = r#"<launch>
        <arg name="robot" default="r1"/><arg name="sim" value="false"/>
        <group ns="$(arg robot)">
          <node pkg="a" type="b" name="lidar"><remap from="scan" to="front/scan"/></node>
          <node pkg="a" type="b" name="cam" if="$(arg sim)"/>
        </group>
        <node pkg="a" type="b" name="map" ns="/maps"/></launch>"#;
    assert_eq!(
        elements(text),
        [
            NamedElement::Node("/r1/lidar".into()),
            NamedElement::Topic("/r1/front/scan".into()),
            NamedElement::Node("/maps/map".into()),
        ]
    );
}

#[test]
fn ros2_is_the_same_in_xml_and_yaml() {
    let xml = r#"<launch><let name="ns" value="r2"/><group><push_ros_namespace namespace="$(var ns)"/>
        <node pkg="a" exec="b" name="nav"><remap from="plan" to="/plan"/></node></group>
        <node pkg="a" exec="b" name="top"/></launch>"#;
    let yaml = "launch:\n- let: {name: ns, value: r2}\n- group:\n  - push_ros_namespace: {namespace: $(var ns)}\n  \
                - node: {pkg: a, exec: b, name: nav, remap: [{from: plan, to: /plan}]}\n- node: {pkg: a, exec: b, name: top}\n";
    let expected = [
        NamedElement::Node("/r2/nav".into()),
        NamedElement::Topic("/plan".into()),
        NamedElement::Node("/top".into()),
    ];
    assert_eq!(elements(xml), expected);
    assert_eq!(elements(yaml), expected);
}

#[test]
fn arguments_of_relays_are_edges() {
    let text = r#"<launch><group ns="r1">
        <node pkg="topic_tools" type="mux" name="mux" args="cmd_vel joy auto"/>
        <node pkg="image_transport" type="republish" name="republish" args="compressed in:=/image raw out:=plain"/>
        </group></launch>"#;
    let edge = |publishes: bool, node: &str, topic: &str| {
        let (node, topic) = (node.to_owned(), topic.to_owned());
        if publishes {
            NamedElement::Publish(node, topic)
        } else {
            NamedElement::Subscribe(node, topic)
        }
    };
    assert_eq!(
        elements(text),
        [
            NamedElement::Node("/r1/mux".into()),
            edge(false, "/r1/mux", "/r1/joy"),
            edge(false, "/r1/mux", "/r1/auto"),
            edge(true, "/r1/mux", "/r1/cmd_vel"),
            NamedElement::Node("/r1/republish".into()),
            edge(false, "/r1/republish", "/image/compressed"),
            edge(true, "/r1/republish", "/r1/plain"),
            NamedElement::Topic("/image".into()),
            NamedElement::Topic("/r1/plain".into()),
        ]
    );
}

#[test]
fn includes_are_followed_with_their_arguments() {
    let folder = tempfile::tempdir().unwrap();
    let launch = folder.path().join("robot/launch");
    std::fs::create_dir_all(&launch).unwrap();
    let inner =
        r#"<launch><arg name="n" default="x"/><node pkg="a" type="b" name="$(arg n)"/></launch>"#;
    std::fs::write(launch.join("inner.launch"), inner).unwrap();
    let outer = r#"<launch><include ns="r1" file="$(find robot)/launch/inner.launch"><arg name="n" value="y"/></include>
        <include file="$(find elsewhere)/x.launch"/></launch>"#;
    let path = launch.join("outer.launch");
    std::fs::write(&path, outer).unwrap();
    let topology = crate::evidence::given::read(&path).unwrap();
    assert_eq!(
        topology.entries[0].element,
        NamedElement::Node("/r1/y".into())
    );
    assert_eq!(topology.notices.len(), 1);
}

#[test]
fn a_file_that_includes_itself_is_read_once() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("self.launch");
    let include = r#"<include file="self.launch"/>"#.repeat(3);
    let text = format!(r#"<launch><node pkg="a" type="b" name="n"/>{include}</launch>"#);
    std::fs::write(&path, text).unwrap();
    let topology = crate::evidence::given::read(&path).unwrap();
    assert_eq!(topology.entries.len(), 1);
    assert!(
        topology.notices[0].text.contains("includes itself"),
        "{:?}",
        topology.notices
    );
}

#[test]
fn repeated_includes_are_bounded() {
    let folder = tempfile::tempdir().unwrap();
    for n in 0..12 {
        let include = format!(r#"<include file="{}.launch"/>"#, n + 1).repeat(10);
        let text = format!(r#"<launch>{include}<node pkg="a" type="b" name="n{n}"/></launch>"#);
        std::fs::write(folder.path().join(format!("{n}.launch")), text).unwrap();
    }
    std::fs::write(folder.path().join("12.launch"), "<launch/>").unwrap();
    let topology = crate::evidence::given::read(&folder.path().join("0.launch")).unwrap();
    let stated = topology
        .notices
        .iter()
        .filter(|n| n.text.contains("too often"));
    assert_eq!(stated.count(), 1);
}

#[test]
fn arguments_that_repeat_each_other_are_bounded() {
    let grow = |n: usize| {
        format!(
            r#"<arg name="a{}" value="{}"/>"#,
            n + 1,
            format!("$(arg a{n})").repeat(10)
        )
    };
    let text: String = (0..9).map(grow).collect();
    let text = format!(
        r#"<launch><arg name="a0" value="{}"/>{text}<node pkg="a" type="b" name="$(arg a9)"/></launch>"#,
        "x".repeat(100)
    );
    assert_eq!(elements(&text), []);
}

#[test]
fn an_undecided_condition_is_reported() {
    let text = r#"<launch><node pkg="a" type="b" name="n" if="$(env SIM)"/></launch>"#;
    let path = Path::new("x.launch");
    let topology = read(path, &tree::of_xml(path, text).unwrap()).unwrap();
    assert!(
        topology.entries.is_empty() && topology.notices[0].text.contains("line 1: its condition")
    );
}

#[test]
fn an_element_with_very_many_attributes_is_refused_before_it_is_parsed() {
    let attributes = |many| (0..many).map(|k| format!(" a{k}=\"\"")).collect::<Vec<_>>();
    let text = |many| format!("<launch>\n<node{}/>\n</launch>", attributes(many).concat());
    let read = |many| tree::of_xml(Path::new("x.launch"), &text(many));
    assert!(read(2000).is_ok());
    let error = read(2001).unwrap_err().to_string();
    assert_eq!(
        error,
        "`x.launch` line 2: an element has more than 2000 attributes"
    );
}

#[test]
fn errors_have_their_line() {
    let error = tree::of_xml(Path::new("x.launch"), "<launch>\n<node>\n</launch>").unwrap_err();
    assert!(error.to_string().contains("line 3"), "{error}");
}

fn topics(package: &str, program: &str, text: &str) -> String {
    let topics = ProgramArguments::new(text).topics(package, program);
    let shown = topics.iter().map(|(publishes, topic)| {
        let sign = if *publishes { "→" } else { "←" };
        format!("{sign}{topic}")
    });
    shown.collect::<Vec<_>>().join(" ")
}

#[test]
fn arguments_name_the_topics_of_relays() {
    for (program, text, expected) in [
        ("relay", "a b", "←a →b"),
        ("relay", "a", "←a →a_relay"),
        ("throttle", "messages a 1.0", "←a →a_throttle"),
        ("throttle", "bytes a 1000 1.0 b", "←a →b"),
        ("drop", "a 1 2", "←a →a_drop"),
        ("mux", "out a b mux:=m", "←a ←b →out"),
        ("demux", "in a b", "→a →b ←in"),
        ("relay_field", "a b", ""),
    ] {
        assert_eq!(
            topics("topic_tools", program, text),
            expected,
            "{program} {text}"
        );
    }
    let republish = "compressed in:=/image raw out:=/plain _x:=1";
    assert_eq!(
        topics("image_transport", "republish", republish),
        "←in/compressed →out"
    );
    let remaps = ProgramArguments::new(republish).remaps;
    assert_eq!(remaps.len(), 2);
}

#[test]
fn a_nodelet_is_the_class_that_it_loads() {
    let loads = |text| ProgramArguments::new(text).nodelet();
    let rectify = Some(("image_proc".to_owned(), "image_proc/rectify".to_owned()));
    assert_eq!(loads("load image_proc/rectify manager"), rectify);
    assert_eq!(loads("manager"), None);
}
