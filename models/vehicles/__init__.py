"""Vehicles: an engine-neutral description each, and equations written straight from its paper."""
