"""The test helpers themselves: processes end with the test, domains do not mix."""

from __future__ import annotations

import signal
import sys

import pytest

pytestmark = pytest.mark.graph


def test_talks_only_inside_its_domain(ros_domain, tmp_path):
    from std_msgs.msg import String

    listener = tmp_path / "listener.py"
    listener.write_text(
        "import rclpy\nfrom std_msgs.msg import String\nrclpy.init()\nn = rclpy.create_node('l')\n"
        "n.create_subscription(String, '/t', lambda m: print('heard', m.data), 10)\nprint('ready')\n"
        "rclpy.spin(n)\n"
    )
    child = ros_domain.start(sys.executable, str(listener))
    ros_domain.env["ROS_DOMAIN_ID"] = str(215 + ros_domain.id % 10)
    stranger = ros_domain.start(sys.executable, str(listener))
    for process in (child, stranger):
        process.wait_for("ready")
    node = ros_domain.node("talker")
    publisher = node.create_publisher(String, "/t", 10)
    assert ros_domain.spin(node, lambda: publisher.get_subscription_count() > 0)
    publisher.publish(String(data="hello"))
    assert child.wait_for("heard") == "heard hello"
    assert "heard" not in stranger.output
    child.send_signal(signal.SIGKILL)
    assert child.wait() == -signal.SIGKILL
