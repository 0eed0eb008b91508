"""Vehicles and rigid-body motions in space on which several systems are validated."""
