"""Hidden periodicities of random signals: envelope spectra, spectral correlation and coherence."""
