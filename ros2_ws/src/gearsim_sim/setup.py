from setuptools import find_packages, setup

NAME = "gearsim_sim"

setup(
    name=NAME,
    version="0.1.0",
    description="Gearbox physics, sensors and the simulator node of the gearsim test rig.",
    license="Apache-2.0",
    author="gearsim maintainers",
    maintainer="gearsim maintainers",
    maintainer_email="maintainers@example.com",
    python_requires=">=3.11",
    packages=find_packages(),
    data_files=[
        ("share/ament_index/resource_index/packages", [f"resource/{NAME}"]),
        (f"share/{NAME}", ["package.xml"]),
    ],
    install_requires=["setuptools"],
    zip_safe=False,
    entry_points={"console_scripts": []},
)
