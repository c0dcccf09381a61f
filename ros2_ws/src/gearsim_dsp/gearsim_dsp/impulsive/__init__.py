"""How impulsive a signal is, and in which band: moments, spectral kurtosis, protrugram, autogram."""
