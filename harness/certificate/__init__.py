"""A bound that holds for every configuration."""
