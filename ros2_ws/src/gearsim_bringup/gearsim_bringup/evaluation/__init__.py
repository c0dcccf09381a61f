"""How often the diagnosis is right: random machines are simulated, diagnosed and scored."""
