"""What `./gearsim` does before the program itself can run: standard library only, Python 3.11 to 3.13."""
