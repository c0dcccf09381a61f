"""Taking a vibration signal apart: what can be predicted or averaged from what cannot.

Linear prediction, discrete/random separation, self-adaptive noise cancellation, the cepstrum, and
deconvolution of the transmission path.
"""
