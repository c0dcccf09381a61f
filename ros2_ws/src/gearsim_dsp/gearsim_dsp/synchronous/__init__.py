"""Signals periodic in a shaft's angle: averages, what is regular in them and what is not, planets apart."""
