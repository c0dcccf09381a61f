"""Parameters of the machines that can be simulated."""

from gearsim_sim.params.parallel import ParallelParams, load_parallel_params

__all__ = ["ParallelParams", "load_parallel_params"]
