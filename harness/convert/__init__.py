"""URDF to DH and back, with proof."""
