//! Tests of reading Python, idiom by idiom.

use super::super::declaration::{FileCode, Role};
use super::read;

/// Every declaration as `+topic package/Type` for a publisher, `-…` for a subscriber, in order.
fn declared(text: &str) -> Vec<String> {
    let words = |code: FileCode| {
        let all = code.classes.into_iter().flat_map(|c| c.declarations);
        all.map(|d| {
            let sign = if d.role == Role::Publishes { '+' } else { '-' };
            format!(
                "{sign}{} {}",
                d.topic.unwrap_or_else(|| "?".to_owned()),
                d.types.join("|")
            )
        })
        .collect()
    };
    words(read(text))
}

/// The names of nodes in each class, the code outside first.
fn names(text: &str) -> Vec<Vec<String>> {
    read(text)
        .classes
        .into_iter()
        .map(|c| c.node_names)
        .collect()
}

#[test]
fn publishers_and_subscribers_of_rclpy() {
    let text = "from std_msgs.msg import String\nimport sensor_msgs.msg as m\nimport geometry_msgs.msg\n\
        class Talker(Node):\n    def __init__(self):\n        super().__init__('talker')\n        \
        self.p = self.create_publisher(String, 'chatter', 10)\n        \
        self.create_subscription(m.Image, '/image', self.cb, qos_profile=1)\n        \
        self.create_subscription(msg_type=geometry_msgs.msg.Twist, topic='~/cmd', callback=self.cb, qos_profile=1)\n";
    assert_eq!(
        declared(text),
        [
            "+chatter std_msgs/String",
            "-/image sensor_msgs/Image",
            "-~/cmd geometry_msgs/Twist"
        ]
    );
    assert_eq!(names(text), [vec![], vec!["talker".to_owned()]]);
}

#[test]
fn rospy_and_python_2() {
    let text = "import rospy\nfrom std_msgs.msg import *\nfrom nav_msgs.msg import Odometry\n\
        def main():\n    rospy.init_node('listener', anonymous=True)\n    \
        rospy.Subscriber('odom', Odometry, cb)\n    pub = rospy.Publisher('~out', Int8, queue_size=1)\n    \
        print 'ready'\n    rospy.wait_for_message('/map', OccupancyGrid)\n";
    assert_eq!(
        declared(text),
        [
            "-odom nav_msgs/Odometry",
            "+~out std_msgs/Int8",
            "-/map std_msgs/OccupancyGrid"
        ]
    );
    assert_eq!(names(text), [vec!["listener".to_owned()]]);
}

#[test]
fn actions_filters_and_transforms() {
    let text = "import message_filters, actionlib, tf2_ros\nfrom rclpy.action import ActionServer\n\
        from move_base_msgs.msg import MoveBaseAction\nfrom sensor_msgs.msg import Image\nfrom f.action import Fib\n\
        a = actionlib.SimpleActionClient('move_base', MoveBaseAction)\n\
        s = message_filters.Subscriber('left', Image)\ns2 = message_filters.Subscriber(node, Image, 'right')\n\
        b = tf2_ros.StaticTransformBroadcaster(node)\nl = tf2_ros.TransformListener(buffer, node)\nx = ActionServer(node, Fib, 'fib', cb)\n";
    assert_eq!(
        declared(text),
        [
            "-move_base/feedback move_base_msgs/MoveBaseActionFeedback",
            "-move_base/result move_base_msgs/MoveBaseActionResult",
            "-move_base/status actionlib_msgs/GoalStatusArray",
            "+move_base/goal move_base_msgs/MoveBaseActionGoal",
            "+move_base/cancel actionlib_msgs/GoalID",
            "-left sensor_msgs/Image",
            "-right sensor_msgs/Image",
            "+/tf_static tf2_msgs/TFMessage",
            "-/tf tf2_msgs/TFMessage",
            "-/tf_static tf2_msgs/TFMessage",
            "+fib/_action/feedback f/Fib_FeedbackMessage",
            "+fib/_action/status action_msgs/GoalStatusArray",
        ]
    );
}

#[test]
fn names_resolve_to_texts() {
    let head = "import rospy\nfrom std_msgs.msg import String\nTOPIC = '/fixed'\n";
    for (code, topic) in [
        ("p = rospy.Publisher(TOPIC, String)", "/fixed"),
        ("t = 'a'\np = rospy.Publisher(t + '/b', String)", "a/b"),
        ("t = 'a'\np = rospy.Publisher(f'{t}/c', String)", "a/c"),
        (
            "p = rospy.Publisher(rospy.get_param('~topic', 'default'), String)",
            "default",
        ),
        (
            "class C(Node):\n    def __init__(self, name='n'):\n        self.t = '/member'\n        self.create_publisher(String, self.t, 1)",
            "/member",
        ),
        (
            "node.declare_parameter('out', 'declared')\nt = node.get_parameter('out').value\nnode.create_publisher(String, t, 1)",
            "declared",
        ),
        ("t = 'one'\nt = 'two'\np = rospy.Publisher(t, String)", "?"),
        ("p = rospy.Publisher(sys.argv[1], String)", "?"),
        ("t = t + t\np = rospy.Publisher(t, String)", "?"),
    ] {
        let found = declared(&format!("{head}{code}\n"));
        assert_eq!(found, [format!("+{topic} std_msgs/String")], "{code}");
    }
}

#[test]
fn growing_texts_are_bounded() {
    let many = "{a}".repeat(2000);
    let text = format!("a = f'{many}'\nimport rospy\nrospy.Publisher(f'{many}', String)\n");
    assert_eq!(declared(&text), ["+? "]);
}

#[test]
fn similar_calls_are_not_declarations() {
    let text = "from zmq import Publisher\np = Publisher('x', y)\n# rospy.Publisher('no', String)\n'''rospy.Publisher('no', String)'''\n";
    assert_eq!(declared(text), [] as [&str; 0]);
}

#[test]
fn loops_over_literals_are_followed() {
    let text = "from std_msgs.msg import String, Int8\nTOPICS = ['a', 'b']\n\
        for name in TOPICS:\n    node.create_publisher(String, '/x/' + name, 1)\n\
        for name, kind in (('c', String), ('d', Int8)):\n    node.create_subscription(kind, name, cb, 1)\n\
        subs = [node.create_subscription(t, n, cb, 1) for n, t in {'e': Int8}.items()]\n\
        for name in unknown():\n    node.create_publisher(String, name, 1)\n";
    assert_eq!(
        declared(text),
        [
            "+/x/a std_msgs/String",
            "+/x/b std_msgs/String",
            "-c std_msgs/String",
            "-d std_msgs/Int8",
            "-e std_msgs/Int8",
            "+? std_msgs/String",
        ]
    );
}
