"""Nodes that pass features, trends and alarms on to monitoring stacks."""
