"""ROS 2: the simulated robot of omentum, and RViz beside it.

    ros2 launch python/examples/dvrk.launch.py scene:=scenes/sheet.yaml domain:=0 rviz:=true

Needs the program omentum on PATH; no package of ROS 2 but launch, launch_ros and rviz2. Both sides are on this machine alone.
"""
from launch import LaunchDescription
from launch.actions import DeclareLaunchArgument, ExecuteProcess, SetEnvironmentVariable
from launch.conditions import IfCondition
from launch.substitutions import LaunchConfiguration
from launch_ros.actions import Node


def generate_launch_description():
    domain = LaunchConfiguration("domain")
    return LaunchDescription([
        DeclareLaunchArgument("scene", description="a scene of omentum, YAML"),
        DeclareLaunchArgument("domain", default_value="0", description="ROS_DOMAIN_ID of both sides"),
        DeclareLaunchArgument("rviz", default_value="true"),
        DeclareLaunchArgument("rmw", default_value="rmw_fastrtps_cpp", description="or rmw_cyclonedds_cpp; rmw_zenoh_cpp hears nothing"),
        SetEnvironmentVariable("RMW_IMPLEMENTATION", LaunchConfiguration("rmw")),
        SetEnvironmentVariable("ROS_AUTOMATIC_DISCOVERY_RANGE", "LOCALHOST"),
        SetEnvironmentVariable("ROS_DOMAIN_ID", domain),
        ExecuteProcess(cmd=["omentum", "dvrk", LaunchConfiguration("scene"), "--domain", domain], output="screen"),
        Node(package="rviz2", executable="rviz2", arguments=["-f", "world"], condition=IfCondition(LaunchConfiguration("rviz"))),
    ])
