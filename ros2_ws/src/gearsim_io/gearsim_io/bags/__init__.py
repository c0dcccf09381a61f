"""Bags: MCAP in rosbag2's layout, written, read, judged and recovered without ROS."""

from gearsim_io.bags.layout import BagError, TopicInfo, bag_files
from gearsim_io.bags.reader import BagInfo, BagMessage, decode, info, read_bag, topics_of
from gearsim_io.bags.records import is_bag, read_machine, read_objects, read_record
from gearsim_io.bags.recover import Recovery, recover
from gearsim_io.bags.stream import StreamWriter
from gearsim_io.bags.writer import BagWriter

__all__ = [
    "BagError",
    "BagInfo",
    "BagMessage",
    "BagWriter",
    "Recovery",
    "StreamWriter",
    "TopicInfo",
    "bag_files",
    "decode",
    "info",
    "is_bag",
    "read_bag",
    "read_machine",
    "read_objects",
    "read_record",
    "recover",
    "topics_of",
]
