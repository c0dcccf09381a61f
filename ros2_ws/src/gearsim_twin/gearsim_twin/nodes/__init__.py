"""ROS 2 nodes of the twin; they only translate."""
