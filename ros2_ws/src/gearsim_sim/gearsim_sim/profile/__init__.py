"""Operating profiles: speed, load and motor torque as piecewise polynomials of the step index.

Pure numpy and scipy. `build.build_profile` makes a `Profile` out of what a scenario says; the compiled
loop is given its segments.
"""
