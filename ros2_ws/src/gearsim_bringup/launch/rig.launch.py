"""The live rig: simulator and diagnostic nodes, with a recorder and ways to monitoring stacks if asked.

ros2 launch gearsim_bringup rig.launch.py scenario:=demo bag:=/tmp/demo_bag
ros2 launch gearsim_bringup rig.launch.py scenario:=gear_wear gear:=true trend:=true exporter:=true
ros2 launch gearsim_bringup rig.launch.py scenario:=demo twin:=lpm34
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
    bag = LaunchConfiguration("bag")
    arguments = [
        DeclareLaunchArgument(
            "scenario", default_value="demo", description="shipped name or path of a YAML file"
        ),
        DeclareLaunchArgument(
            "rate_factor", default_value="1.0", description="times real time, 0 as fast as it goes"
        ),
        DeclareLaunchArgument("namespace", default_value="gearsim"),
        DeclareLaunchArgument(
            "bag", default_value="", description="folder to record to; empty: no recording"
        ),
        DeclareLaunchArgument("gear", default_value="false", description="judge gears against a baseline"),
        DeclareLaunchArgument("trend", default_value="false", description="follow all indicators"),
        DeclareLaunchArgument("twin", default_value="", description="model to run beside, such as lpm34"),
        DeclareLaunchArgument("exporter", default_value="false", description="metrics at 127.0.0.1:9812"),
        DeclareLaunchArgument("mqtt", default_value="false", description="to the broker at 127.0.0.1:1883"),
    ]
    simulator = Node(
        package="gearsim_sim",
        executable="simulator",
        namespace=namespace,
        output="screen",
        parameters=[
            {
                "scenario": LaunchConfiguration("scenario"),
                "rate_factor": ParameterValue(LaunchConfiguration("rate_factor"), value_type=float),
            }
        ],
    )
    monitors = [
        Node(package="gearsim_dsp", executable=name, namespace=namespace, output="screen")
        for name in ("envelope", "kurtosis")
    ]
    asked_for = [
        Node(
            package=package,
            executable=name,
            namespace=namespace,
            output="screen",
            condition=IfCondition(LaunchConfiguration(name)),
        )
        for package, names in (("gearsim_dsp", ("trend", "gear")), ("gearsim_bringup", ("exporter", "mqtt")))
        for name in names
    ]
    recorder = Node(
        package="gearsim_io",
        executable="recorder",
        namespace=namespace,
        output="screen",
        parameters=[{"bag": bag}],
        condition=IfCondition(PythonExpression(["'", bag, "' != ''"])),
    )
    model = LaunchConfiguration("twin")
    twin = Node(
        package="gearsim_twin",
        executable="twin",
        namespace=namespace,
        output="screen",
        parameters=[{"model": ParameterValue(model, value_type=str)}],
        condition=IfCondition(PythonExpression(["'", model, "' != ''"])),
    )
    return LaunchDescription([*arguments, recorder, *asked_for, twin, *monitors, simulator])
