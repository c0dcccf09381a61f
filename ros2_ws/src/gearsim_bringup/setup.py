"""Builds gearsim_bringup. Its name, version, description and maintainer are in package.xml alone."""

from glob import glob
from pathlib import Path
from xml.etree import ElementTree

from setuptools import find_packages, setup

HERE = Path(__file__).resolve().parent
ABOUT = ElementTree.parse(HERE / "package.xml").getroot()
NAME = ABOUT.findtext("name")
VERSION = ABOUT.findtext("version")

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
    package_data={
        NAME: [
            "bench/peers/*.txt",
            "monitoring/files/*.*",
            "diagnosis_report/files/*.*",
            "pages/files/*.*",
            "twin_report/files/*.*",
        ]
    },
    data_files=[
        ("share/ament_index/resource_index/packages", [f"resource/{NAME}"]),
        (f"share/{NAME}", ["package.xml"]),
        (f"share/{NAME}/launch", sorted(glob("launch/*.launch.py"))),
    ],
    # What runs without ROS; rclpy and the messages come with ROS, see package.xml.
    install_requires=[
        "numpy>=1.26",
        "scipy>=1.11",
        "rosbags>=0.10",
        "soundfile>=0.12",
        "click>=8.1",
        "rich>=13",
        "psutil>=5.9",
        "matplotlib>=3.8",
        "pydantic>=2",
        "prometheus-client>=0.20",
        "paho-mqtt>=2.1",
        "jinja2>=3.1",
        "markupsafe>=2.1",
        f"gearsim_io=={VERSION}",
        f"gearsim_sim=={VERSION}",
        f"gearsim_dsp=={VERSION}",
        f"gearsim_twin=={VERSION}",
    ],
    # What `gearsim bench` compares with.
    extras_require={"bench": ["PySDKit==0.5.0", "openconmo==0.0.6"]},
    zip_safe=False,
    entry_points={
        "console_scripts": [
            "gearsim = gearsim_bringup.cli:main",
            "exporter = gearsim_bringup.monitoring.nodes.exporter:main",
            "mqtt = gearsim_bringup.monitoring.nodes.mqtt:main",
        ]
    },
)
