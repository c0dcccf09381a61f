"""Checks of the simulator against something independent: accuracy against DOP853, ledger of energy.

`python -m gearsim_sim.verify accuracy` and `... energy` print the tables of docs/accuracy.md and
docs/energy.md.
"""
