"""Equations of motion of a vehicle as a tree of bodies, and the forces between the bodies, compiled once for every
engine."""
