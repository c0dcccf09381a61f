"""Builds gearsim_sim. Its name, version, description and maintainer are in package.xml alone."""

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
            "scenarios/*.yaml",
            "scenarios/*.csv",
            "sensors/*.yaml",
            "sensors/catalogue/*/*.yaml",
            "model/casing/descriptions/*.*",
            "model/casing/reduced_files/*.npz",
            "frf/files/*.npz",
        ]
    },
    data_files=[
        ("share/ament_index/resource_index/packages", [f"resource/{NAME}"]),
        (f"share/{NAME}", ["package.xml"]),
    ],
    # What runs without ROS; rclpy and the messages come with ROS, see package.xml.
    install_requires=[
        "numpy>=1.26",
        "scipy>=1.11",
        "numba>=0.59",
        "llvmlite>=0.42",
        "pydantic>=2",
        "ruamel.yaml>=0.18",
        f"gearsim_io=={VERSION}",
    ],
    # What reads Nastran's matrices of a casing of one's own; what reads its modal test and finds the modes.
    extras_require={"nastran": ["pyyeti>=1.4.7"], "modal_test": ["sdypy-EMA>=0.31", "pyuff>=2.4"]},
    zip_safe=False,
    entry_points={
        "console_scripts": [
            "simulator = gearsim_sim.nodes.simulator:main",
        ]
    },
)
