"""Shows the graph of each window in rqt_dotgraph while a bag plays.

    python3 rqt_dotgraph.py run.mcap &  ros2 run rqt_dotgraph rqt_dotgraph &  ros2 bag play run.mcap --clock
"""

import json
import pathlib
import subprocess
import sys
import tempfile

import rclpy
from rosgraph_msgs.msg import Clock
from std_msgs.msg import String

out = pathlib.Path(tempfile.mkdtemp())
dots, data = str(out / "{n}.dot"), out / "windows.json"
subprocess.run(["bagreel", "render", sys.argv[1], "-o", dots, "-o", str(data)], check=True)
starts = [window["start_ns"] for window in json.loads(data.read_text())["windows"]]
graphs = [path.read_text() for path in sorted(out.glob("*.dot"))]

rclpy.init()
node = rclpy.create_node("graph_of_the_bag")
publisher = node.create_publisher(String, "dot_graph", 1)
shown = []


def show(message):
    now = message.clock.sec * 10**9 + message.clock.nanosec
    window = max(sum(start <= now for start in starts) - 1, 0)
    if shown != [window]:
        shown[:] = [window]
        publisher.publish(String(data=graphs[window]))


node.create_subscription(Clock, "/clock", show, 10)
rclpy.spin(node)
