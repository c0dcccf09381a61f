"""The rig as a rerun recording: entities, their style and the arrangement of views. Knows no ROS."""

from gearsim_io.scene.canvas import TIMELINE, Canvas
from gearsim_io.scene.layout import Focus, blueprint
from gearsim_io.scene.overview import Overview, look_through
from gearsim_io.scene.scene import Scene, Zoom

__all__ = ["TIMELINE", "Canvas", "Focus", "Overview", "Scene", "Zoom", "blueprint", "look_through"]
