"""Streaming diagnosis: from batches as they arrive to windows, features and the inputs of alarms."""
