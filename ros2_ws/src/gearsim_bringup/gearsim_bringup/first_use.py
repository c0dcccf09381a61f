"""A word of patience where equations are compiled for the first time."""

from __future__ import annotations

from gearsim_bringup.ui import Voice


def tell_first_use(voice: Voice) -> None:
    """Say that the first run takes longer, if nothing has been compiled on this computer yet."""
    from gearsim_sim.integrate.compiled import cache_folder

    folder = cache_folder()
    if folder is None or not any(folder.rglob("*.nbi")):
        voice.say("compiling the equations for the first time, which takes up to a minute")
