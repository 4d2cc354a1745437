//! Tests of reading C++, idiom by idiom.

use super::super::declaration::Role;
use super::read;

/// Every declaration as `+topic package/Type` for a publisher, `-…` for a subscriber, in order.
fn declared(text: &str) -> Vec<String> {
    let all = read(text).classes.into_iter().flat_map(|c| c.declarations);
    all.map(|d| {
        let sign = if d.role == Role::Publishes { '+' } else { '-' };
        format!(
            "{sign}{} {}",
            d.topic.unwrap_or_else(|| "?".to_owned()),
            d.types.join("|")
        )
    })
    .collect()
}

/// The names of nodes by class, the code outside first.
fn names(text: &str) -> Vec<(String, Vec<String>)> {
    read(text)
        .classes
        .into_iter()
        .map(|c| (c.name, c.node_names))
        .collect()
}

#[test]
fn publishers_and_subscribers_of_rclcpp() {
    let text = r#"using std::placeholders::_1;
        using sensor_msgs::msg::Image;
        namespace arm { class Talker : public rclcpp::Node { public:
          Talker(const rclcpp::NodeOptions & o) : Node("talker", o) {
            pub_ = this->create_publisher<std_msgs::msg::String>("chatter", 10);
            a_ = create_subscription<Image>("/image", 1, std::bind(&Talker::on_image, this, _1));
            b_ = rclcpp::create_subscription<geometry_msgs::msg::Twist>(this, "~/cmd", 1, cb);
          }
        }; }"#;
    assert_eq!(
        declared(text),
        [
            "+chatter std_msgs/String",
            "-/image sensor_msgs/Image",
            "-~/cmd geometry_msgs/Twist"
        ]
    );
    assert_eq!(
        names(text)[1],
        ("Talker".to_owned(), vec!["talker".to_owned()])
    );
}

#[test]
fn roscpp_types_come_from_callbacks_and_namespaces_from_handles() {
    let text = r#"void onScan(const sensor_msgs::LaserScan::ConstPtr& m) {}
        void Hear::onMap(const nav_msgs::OccupancyGridConstPtr m) {}
        int main(int argc, char** argv) {
          ros::init(argc, argv, "hear");
          ros::NodeHandle nh; ros::NodeHandle pnh("~"); ros::NodeHandle arm(pnh, "arm");
          ros::Subscriber a = nh.subscribe("scan", 1, onScan);
          ros::Subscriber b = pnh.subscribe("map", 1, &Hear::onMap, &hear);
          ros::Subscriber c = nh.subscribe<std_msgs::Bool>("go", 1, boost::bind(&f, _1));
          ros::Subscriber d = nh.subscribe("odd", 1, [](const std::shared_ptr<std_msgs::Int8 const>& m) {});
          ros::Publisher e = arm.advertise<std_msgs::String>("out", 1, true);
        }"#;
    assert_eq!(
        declared(text),
        [
            "-scan sensor_msgs/LaserScan",
            "-~/map nav_msgs/OccupancyGrid",
            "-go std_msgs/Bool",
            "-odd std_msgs/Int8",
            "+~/arm/out std_msgs/String",
        ]
    );
    assert_eq!(names(text)[0].1, ["hear"]);
}

#[test]
fn filters_actions_images_and_transforms() {
    let text = r#"class C { C() : left_(nh_, "left", 1), server_(nh_, "go", false) {
            right_.subscribe(nh_, "right", 1);
            image_transport::ImageTransport it(nh_);
            img_ = it.advertise("img", 1);
            cam_ = it.subscribeCamera("cam/raw", 1, &C::cb, this);
            fib_ = rclcpp_action::create_client<f::action::Fib>(this, "fib");
            tf_ = std::make_unique<tf2_ros::TransformBroadcaster>(this);
            listener_ = std::make_shared<tf2_ros::TransformListener>(*buffer_);
          }
          message_filters::Subscriber<sensor_msgs::Image> left_, right_x;
          message_filters::Subscriber<sensor_msgs::CameraInfo> right_;
          actionlib::SimpleActionServer<m::GoAction> server_; };"#;
    assert_eq!(
        declared(text),
        [
            "-left sensor_msgs/Image",
            "+go/feedback m/GoActionFeedback",
            "+go/result m/GoActionResult",
            "+go/status actionlib_msgs/GoalStatusArray",
            "-go/goal m/GoActionGoal",
            "-go/cancel actionlib_msgs/GoalID",
            "-right sensor_msgs/CameraInfo",
            "+img sensor_msgs/Image",
            "+img/compressed sensor_msgs/CompressedImage",
            "+img/compressedDepth sensor_msgs/CompressedImage",
            "-cam/raw sensor_msgs/Image",
            "-cam/camera_info sensor_msgs/CameraInfo",
            "-fib/_action/feedback f/Fib_FeedbackMessage",
            "-fib/_action/status action_msgs/GoalStatusArray",
            "+/tf tf2_msgs/TFMessage",
            "-/tf tf2_msgs/TFMessage",
            "-/tf_static tf2_msgs/TFMessage",
        ]
    );
}

#[test]
fn names_resolve_to_texts_and_types() {
    for (head, topic, expected) in [
        ("#define TOPIC \"/fixed\"", "TOPIC", "/fixed"),
        ("static constexpr char TOPIC[] = \"/k\";", "TOPIC", "/k"),
        ("const std::string t = \"a\";", "t + \"/b\"", "a/b"),
        ("const std::string t{\"braces\"};", "t", "braces"),
        (
            "",
            "declare_parameter<std::string>(\"p\", \"declared\")",
            "declared",
        ),
        ("", "get_topic()", "?"),
        ("std::string t = \"a\"; std::string t = \"b\";", "t", "?"),
    ] {
        let text = format!(
            "{head}\nvoid f() {{ node->create_publisher<std_msgs::msg::Empty>({topic}, 1); }}"
        );
        assert_eq!(
            declared(&text),
            [format!("+{expected} std_msgs/Empty")],
            "{topic}"
        );
    }
    let text = "using namespace geometry_msgs; namespace sm = sensor_msgs::msg; typedef std_msgs::String S; using A = S;\n\
        void f() { nh.advertise<Twist>(\"a\", 1); n.create_publisher<sm::Imu>(\"b\", 1); nh.advertise<A>(\"c\", 1); }";
    assert_eq!(
        declared(text),
        [
            "+a geometry_msgs/Twist",
            "+b sensor_msgs/Imu",
            "+c std_msgs/String"
        ]
    );
}

#[test]
fn a_name_passed_to_a_constructor_is_found_in_the_call() {
    let text = r#"class Walker : public rclcpp::Node { public:
          Walker(const std::string &n) : Node(n) { create_publisher<std_msgs::msg::Bool>("on", 1); } };
        int main() { rclcpp::spin(std::make_shared<Walker>("walker")); }"#;
    let classes = read(text).classes;
    assert_eq!(
        classes[0].mentions.get("Walker"),
        Some(&Some("walker".to_owned()))
    );
    assert_eq!(names(text)[1].1, [] as [&str; 0]);
}

#[test]
fn functions_outside_their_class_belong_to_it() {
    let text = "#include \"x.hpp\"\nFoo::Foo() : Base(\"foo_node\") { }\nvoid a::Foo::run() { create_publisher<std_msgs::msg::Bool>(\"on\", 1); }";
    let classes = read(text).classes;
    let foo = &classes[1];
    assert_eq!(
        (foo.name.as_str(), foo.declarations.len(), foo.is_defined),
        ("Foo", 1, false)
    );
}

#[test]
fn macros_and_broken_code_are_tolerated() {
    let text = "#define A A A\n#define B B(B(B\nQ_OBJECT_LIKE(x) class X EXPORT : public Y { );\n\
        void f() { auto p = node->create_publisher<std_msgs::msg::Bool>(\"on\", 1); }";
    assert_eq!(declared(text), ["+on std_msgs/Bool"]);
}

#[test]
fn similar_calls_are_not_declarations() {
    let text = "void f() { mqtt_subscribe(\"x\"); subscribe(\"y\"); auto c = create_client<a::srv::B>(\"s\"); /* nh.advertise<a::B>(\"z\", 1); */ }";
    assert_eq!(declared(text), [] as [&str; 0]);
}
