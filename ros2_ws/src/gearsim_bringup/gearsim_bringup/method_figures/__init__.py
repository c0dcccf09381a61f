"""Pictures of the methods at work on measured records, one module per picture with `draw(records)`.

`FIGURES` is the registry: a name in it is the module here, the picture `<name>.png` and the page
`docs/methods/<name>.md` that shows it.
"""

FIGURES: tuple[str, ...] = (
    "angular_resampling",
    "autogram",
    "cepstrum",
    "deconvolution",
    "discrete_random_separation",
    "encoders",
    "enhanced_envelope_spectrum",
    "gear_indicators",
    "gear_kinematics",
    "kurtogram",
    "linear_prediction",
    "mesh_demodulation",
    "planet_separation",
    "protrugram",
    "scf_slices",
    "self_adaptive_noise_cancellation",
    "spall_size",
    "spectral_coherence",
    "spectral_kurtosis",
    "speed_without_tacho",
    "squared_envelope_spectrum",
    "synchronous_average",
    "whirl",
)
