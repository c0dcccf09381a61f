"""Builds gearsim_io. Its name, version, description and maintainer are in package.xml alone."""

from pathlib import Path
from xml.etree import ElementTree

from setuptools import find_packages, setup
from setuptools.command.build_py import build_py

HERE = Path(__file__).resolve().parent
ABOUT = ElementTree.parse(HERE / "package.xml").getroot()
NAME = ABOUT.findtext("name")
VERSION = ABOUT.findtext("version")
MESSAGES = HERE.parent / "gearsim_msgs" / "msg"


class BuildWithMessages(build_py):
    """Puts the .msg texts into the package, so that bags can be read and written without ROS."""

    def run(self):
        super().run()
        target = Path(self.build_lib) / NAME / "message_definitions"
        for path in sorted(MESSAGES.glob("*.msg")):
            self.mkpath(str(target))
            self.copy_file(str(path), str(target / path.name))


setup(
    name=NAME,
    version=VERSION,
    description=ABOUT.findtext("description"),
    license=ABOUT.findtext("license"),
    author=ABOUT.findtext("maintainer"),
    maintainer=ABOUT.findtext("maintainer"),
    maintainer_email=ABOUT.find("maintainer").get("email"),
    python_requires=">=3.11",
    packages=find_packages(),
    package_data={NAME: ["machines/*.yaml"]},
    data_files=[
        ("share/ament_index/resource_index/packages", [f"resource/{NAME}"]),
        (f"share/{NAME}", ["package.xml"]),
    ],
    # What runs without ROS; rclpy and the messages come with ROS, see package.xml.
    install_requires=[
        "numpy>=1.26",
        "scipy>=1.11",
        "pydantic>=2",
        "pint>=0.24",
        "ruamel.yaml>=0.18",
        "mcap>=1.2",
        "rosbags>=0.10",
        "rerun-sdk>=0.41,<0.42",
        "h5py>=3.10",
        "pyuff>=2.4",
        "soundfile>=0.12",
    ],
    zip_safe=False,
    cmdclass={"build_py": BuildWithMessages},
    entry_points={
        "console_scripts": [
            "recorder = gearsim_io.nodes.recorder:main",
            "player = gearsim_io.nodes.player:main",
            "viewer = gearsim_io.nodes.viewer:main",
        ]
    },
)
