//! Tests of reading launch files in Python, idiom by idiom.

use std::path::Path;

use crate::evidence::given::launch;
use crate::evidence::given::{NamedElement, Topology, read};

fn topology(text: &str) -> Topology {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("robot.launch.py");
    std::fs::write(&path, text).unwrap();
    read(&path).unwrap()
}

/// The nodes that a launch description of these lines starts; `actions` is its list.
fn nodes(lines: &str, actions: &str) -> Vec<String> {
    let body = indented(lines);
    let text = format!(
        "def generate_launch_description():\n{body}    return LaunchDescription([{actions}])\n"
    );
    named(&topology(&text))
}

fn indented(lines: &str) -> String {
    lines
        .lines()
        .flat_map(|line| ["    ", line, "\n"])
        .collect()
}

#[test]
fn arguments_of_a_relay_are_edges() {
    let node =
        "Node(package='topic_tools', executable='relay', name='relay', arguments=['/a', '/b'])";
    let text =
        format!("def generate_launch_description():\n    return LaunchDescription([{node}])\n");
    let edges = topology(&text).entries.into_iter().map(|e| e.element);
    let publishes = NamedElement::Publish("/relay".into(), "/b".into());
    assert!(edges.into_iter().any(|edge| edge == publishes));
}

fn named(topology: &Topology) -> Vec<String> {
    let name = |element: &NamedElement| match element {
        NamedElement::Node(name) => Some(name.clone()),
        _ => None,
    };
    topology
        .entries
        .iter()
        .filter_map(|e| name(&e.element))
        .collect()
}

#[test]
fn nodes_have_names_namespaces_and_remaps() {
    let text = "from launch import LaunchDescription\nimport launch_ros.actions\n\n\
        def generate_launch_description():\n    \
            ns = 'r1'\n    \
            return LaunchDescription([\n        \
                launch_ros.actions.Node(package='a', executable='b', name='nav', namespace=ns,\n            \
                     remappings=[('scan', 'front/scan'), ('/map', '/maps/now')]),\n        \
                LifecycleNode(package='a', executable='c', name='map', namespace='')])\n";
    let topology = topology(text);
    let elements: Vec<NamedElement> = topology.entries.iter().map(|e| e.element.clone()).collect();
    assert_eq!(
        elements,
        [
            NamedElement::Node("/map".into()),
            NamedElement::Node("/r1/nav".into()),
            NamedElement::Topic("/maps/now".into()),
            NamedElement::Topic("/r1/front/scan".into()),
        ]
    );
    assert_eq!(topology.entries[1].place, "robot.launch.py line 7");
    assert!(topology.notices.is_empty(), "{:?}", topology.notices);
}

#[test]
fn arguments_have_defaults_and_texts_are_joined() {
    let lines = "robot = LaunchConfiguration('robot')\nkind = 'cam'";
    for (name, expected) in [
        ("robot", "/r7"),
        ("[robot, '_', TextSubstitution(text='x')]", "/r7_x"),
        ("f'{kind}_left'", "/cam_left"),
        ("kind + '_right'", "/cam_right"),
        ("'%s_%d' % (kind, 3)", "/cam_3"),
        ("'{}_{}'.format(kind, 'a')", "/cam_a"),
        ("PythonExpression([\"'\", robot, \"_y'\"])", "/r7_y"),
        ("EnvironmentVariable('NAME', default_value='env')", "/env"),
    ] {
        let actions = format!(
            "DeclareLaunchArgument('robot', default_value='r7'), Node(package='a', executable='b', name={name})"
        );
        assert_eq!(nodes(lines, &actions), [expected], "{name}");
    }
}

#[test]
fn decidable_conditions_are_decided() {
    let lines = "sim = LaunchConfiguration('sim')\nslam = LaunchConfiguration('slam')";
    for (condition, met) in [
        ("IfCondition(sim)", true),
        ("UnlessCondition(sim)", false),
        ("IfCondition(PythonExpression(['not ', sim]))", false),
        (
            "IfCondition(PythonExpression([sim, ' and not ', slam]))",
            true,
        ),
        (
            "IfCondition(PythonExpression([\"'\", sim, \"' == 'true'\"]))",
            true,
        ),
        ("LaunchConfigurationEquals('slam', 'False')", true),
        ("IfCondition(EqualsSubstitution(slam, 'True'))", false),
        ("IfCondition(NotSubstitution(slam))", true),
        ("IfCondition(OrSubstitution(slam, sim))", true),
    ] {
        let actions = format!(
            "DeclareLaunchArgument('sim', default_value='true'), DeclareLaunchArgument('slam', default_value='False'), \
             Node(package='a', executable='b', name='n', condition={condition})"
        );
        assert_eq!(
            nodes(lines, &actions).len(),
            usize::from(met),
            "{condition}"
        );
    }
}

#[test]
fn groups_containers_and_timers_contain_nodes() {
    let actions = "GroupAction(actions=[PushRosNamespace('g'), SetRemap(src='scan', dst='lidar'), \
            Node(package='a', executable='b', name='in')]), \
        ComposableNodeContainer(name='box', namespace='c', package='rclcpp_components', executable='component_container', \
            composable_node_descriptions=[ComposableNode(package='p', plugin='p::P', name='part', namespace='c')]), \
        LoadComposableNodes(target_container='box', composable_node_descriptions=[ComposableNode(package='p', plugin='p::Q', name='more')]), \
        TimerAction(period=5.0, actions=[Node(package='a', executable='b', name='late')]), \
        RegisterEventHandler(OnProcessExit(target_action=x, on_exit=[Node(package='a', executable='b', name='after')])), \
        Node(package='a', executable='b', name='out')";
    let expected = [
        "/after", "/c/box", "/c/part", "/g/in", "/late", "/more", "/out",
    ];
    assert_eq!(nodes("", actions), expected);
}

#[test]
fn loops_lists_and_functions_of_the_file_are_followed() {
    let lines = "ld = LaunchDescription()\n\
        for i, side in enumerate(['left', 'right']):\n    ld.add_action(camera(side, i))\n\
        more = [Node(package='a', executable='b', name='m' + str(n)) for n in range(2)]\n\
        more += [Node(package='a', executable='b', name='last')]\n\
        return LaunchDescription(ld + more)";
    let body = indented(lines);
    let text = format!(
        "def camera(side, number, kind='cam'):\n    return Node(package='a', executable='b', name=f'{{kind}}_{{side}}{{number}}')\n\
         def generate_launch_description():\n{body}"
    );
    let expected = ["/cam_left0", "/cam_right1", "/last", "/m0", "/m1"];
    assert_eq!(named(&topology(&text)), expected);
}

#[test]
fn opaque_functions_are_followed_and_unknowns_reported() {
    let text = "def setup(context, *args, **kwargs):\n    \
            name = LaunchConfiguration('robot').perform(context)\n    \
            nodes = [Node(package='a', executable='b', name=name)]\n    \
            if context.launch_configurations['x'] == 'y':\n        \
                nodes.append(Node(package='a', executable='b', name='maybe'))\n    \
            return nodes\n\n\
        def generate_launch_description():\n    \
            return LaunchDescription([DeclareLaunchArgument('robot', default_value='r1'), OpaqueFunction(function=setup), elsewhere()])\n";
    let topology = topology(text);
    assert_eq!(named(&topology), ["/r1"]);
    let texts: Vec<&str> = topology.notices.iter().map(|n| n.text.as_str()).collect();
    assert!(
        texts
            .iter()
            .any(|t| t.contains("line 5: its condition is only known at run time")),
        "{texts:?}"
    );
    assert!(
        texts
            .iter()
            .any(|t| t.contains("line 9: this is only known at run time")),
        "{texts:?}"
    );
}

#[test]
fn includes_find_their_package_beside_the_file() {
    let folder = tempfile::tempdir().unwrap();
    let launch = folder.path().join("robot/launch");
    std::fs::create_dir_all(&launch).unwrap();
    let inner = "def generate_launch_description():\n    return LaunchDescription([\n        \
        DeclareLaunchArgument('n', default_value='x'), Node(package='a', executable='b', name=LaunchConfiguration('n'))])\n";
    std::fs::write(launch.join("inner.launch.py"), inner).unwrap();
    let outer = "def generate_launch_description():\n    here = get_package_share_directory('robot')\n    return LaunchDescription([\n        \
        IncludeLaunchDescription(PythonLaunchDescriptionSource([os.path.join(here, 'launch'), '/inner.launch.py']), launch_arguments={'n': 'y'}.items()),\n        \
        IncludeLaunchDescription(PythonLaunchDescriptionSource(PathJoinSubstitution([FindPackageShare('robot'), 'launch', 'inner.launch.py']))),\n        \
        IncludeLaunchDescription(PythonLaunchDescriptionSource([ThisLaunchFileDir(), '/inner.launch.py']), launch_arguments=[('n', 'z')])])\n";
    let path = launch.join("outer.launch.py");
    std::fs::write(&path, outer).unwrap();
    let topology = read(&path).unwrap();
    assert_eq!(
        named(&topology),
        ["/x", "/y", "/z"],
        "{:?}",
        topology.notices
    );
}

#[test]
fn every_node_that_may_start_is_listed_on_request() {
    let text = "def generate_launch_description():\n    ld = LaunchDescription()\n    \
        if os.environ['MODEL'] == 'burger':\n        ld.add_action(Node(package='a', executable='b', name='n'))\n    \
        else:\n        ld.add_action(Node(package='c', executable='d'))\n    return ld\n";
    let path = Path::new("x.launch.py");
    let tree = launch::tree_of(path, text).unwrap().unwrap();
    let nodes = launch::nodes(path, &tree);
    let found: Vec<_> = nodes
        .iter()
        .map(|n| (&*n.package, &*n.program, n.name.as_deref(), n.line))
        .collect();
    assert_eq!(found, [("a", "b", Some("n"), 4), ("c", "d", None, 6)]);
}

#[test]
fn evaluation_is_static_and_bounded() {
    for body in [
        "    a = ['x']\n    for i in range(1000):\n        a = [a, a]\n    return LaunchDescription(a)\n",
        "    a = 'x'\n    for i in range(1000):\n        a = a + a\n    return LaunchDescription([Node(name=a)])\n",
        "    return generate_launch_description()\n",
        "    for i in range(1000):\n        for j in range(1000):\n            for k in range(1000):\n                x = i\n    return LaunchDescription([])\n",
        "    open('/nowhere/x', 'w').write('x')\n    return LaunchDescription([Node(name=os.popen('id').read())])\n",
    ] {
        let topology = topology(&format!("def generate_launch_description():\n{body}"));
        assert_eq!(named(&topology), [] as [&str; 0], "{body}");
    }
    let deep = format!(
        "def generate_launch_description():\n    return {}1{}\n",
        "[".repeat(5000),
        "]".repeat(5000)
    );
    assert_eq!(named(&topology(&deep)), [] as [&str; 0]);
}

#[test]
fn a_file_without_a_launch_description_is_refused() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("setup.py");
    std::fs::write(&path, "print('hello')\n").unwrap();
    let error = read(&path).unwrap_err();
    assert!(
        error.to_string().contains("generate_launch_description"),
        "{error}"
    );
}
