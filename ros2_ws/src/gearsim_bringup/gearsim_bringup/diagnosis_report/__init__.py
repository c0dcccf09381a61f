"""The page of `diagnose --report`: one HTML file with the verdict, its evidence and interactive plots."""
