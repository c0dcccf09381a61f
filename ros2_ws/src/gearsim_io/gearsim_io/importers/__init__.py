"""Measured files (.mat .csv .wav .npz .npy .h5 .uff) as records and bags."""

from gearsim_io.importers.build import import_file, machine_for
from gearsim_io.importers.content import READERS, Content, reads
from gearsim_io.importers.settings import ImportSettings, Overrides, load_settings
from gearsim_io.importers.to_bag import import_to_bag

__all__ = [
    "READERS",
    "Content",
    "ImportSettings",
    "Overrides",
    "import_file",
    "import_to_bag",
    "load_settings",
    "machine_for",
    "reads",
]
