"""What monitoring stacks take from the rig: metrics for Prometheus, messages for MQTT, and their settings."""
