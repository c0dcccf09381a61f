from pathlib import Path

from setuptools import find_packages, setup
from setuptools.command.build_py import build_py

NAME = "gearsim_io"
MESSAGES = Path(__file__).resolve().parent.parent / "gearsim_msgs" / "msg"


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
    version="0.1.0",
    description="Signals, records, bags, importers and rerun export of the gearsim test rig.",
    license="Apache-2.0",
    author="gearsim maintainers",
    maintainer="gearsim maintainers",
    maintainer_email="maintainers@example.com",
    python_requires=">=3.11",
    packages=find_packages(),
    package_data={NAME: ["machines/*.yaml"]},
    data_files=[
        ("share/ament_index/resource_index/packages", [f"resource/{NAME}"]),
        (f"share/{NAME}", ["package.xml"]),
    ],
    install_requires=["setuptools"],
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
