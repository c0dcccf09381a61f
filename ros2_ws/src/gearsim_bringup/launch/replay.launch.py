"""A bag through the diagnostic nodes.

ros2 launch gearsim_bringup replay.launch.py bag:=/tmp/demo_bag
"""

from launch import LaunchDescription
from launch.actions import DeclareLaunchArgument
from launch.substitutions import LaunchConfiguration
from launch_ros.actions import Node
from launch_ros.parameter_descriptions import ParameterValue


def generate_launch_description():
    """Declare the arguments and nodes."""
    namespace = LaunchConfiguration("namespace")
    arguments = [
        DeclareLaunchArgument("bag", description="folder of the bag"),
        DeclareLaunchArgument("rate", default_value="1.0", description="times the recorded pace"),
        DeclareLaunchArgument("loop", default_value="false"),
        DeclareLaunchArgument("namespace", default_value="gearsim"),
    ]
    monitors = [
        Node(package="gearsim_dsp", executable=name, namespace=namespace, output="screen")
        for name in ("envelope", "kurtosis")
    ]
    player = Node(
        package="gearsim_io",
        executable="player",
        namespace=namespace,
        output="screen",
        parameters=[
            {
                "bag": LaunchConfiguration("bag"),
                "rate": ParameterValue(LaunchConfiguration("rate"), value_type=float),
                "loop": ParameterValue(LaunchConfiguration("loop"), value_type=bool),
                "signals_only": True,  # the bag's own alarms would mix with the new ones
                "wait_for": ["accel"],
                "min_subscribers": len(monitors),
            }
        ],
    )
    return LaunchDescription([*arguments, *monitors, player])
