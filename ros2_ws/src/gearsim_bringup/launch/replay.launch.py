"""A bag through the diagnostic nodes.

ros2 launch gearsim_bringup replay.launch.py bag:=/tmp/demo_bag
ros2 launch gearsim_bringup replay.launch.py bag:=/tmp/demo_bag twin:=out/twin_1/extended.yaml
"""

from launch import LaunchDescription
from launch.actions import DeclareLaunchArgument
from launch.conditions import IfCondition
from launch.substitutions import LaunchConfiguration, PythonExpression
from launch_ros.actions import Node
from launch_ros.parameter_descriptions import ParameterValue


def generate_launch_description():
    """Declare the arguments and nodes."""
    namespace = LaunchConfiguration("namespace")
    arguments = [
        DeclareLaunchArgument("bag", description="folder of the bag"),
        DeclareLaunchArgument("rate", default_value="1.0", description="times the recorded pace"),
        DeclareLaunchArgument("loop", default_value="false"),
        DeclareLaunchArgument("twin", default_value="", description="model to run beside, such as lpm34"),
        DeclareLaunchArgument("namespace", default_value="gearsim"),
    ]
    monitors = [
        Node(package="gearsim_dsp", executable=name, namespace=namespace, output="screen")
        for name in ("envelope", "kurtosis")
    ]
    model = LaunchConfiguration("twin")
    asked = PythonExpression(["'", model, "' != ''"])
    twin = Node(
        package="gearsim_twin",
        executable="twin",
        namespace=namespace,
        output="screen",
        parameters=[{"model": ParameterValue(model, value_type=str)}],
        condition=IfCondition(asked),
    )
    listeners = PythonExpression([str(len(monitors)), " + (", asked, ")"])
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
                "min_subscribers": ParameterValue(listeners, value_type=int),
            }
        ],
    )
    return LaunchDescription([*arguments, twin, *monitors, player])
