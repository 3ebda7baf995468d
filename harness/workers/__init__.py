"""Engines in processes of their own: protocol, pool, environments."""
