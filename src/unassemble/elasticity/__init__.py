"""Coordinates from an elasticity matrix."""
