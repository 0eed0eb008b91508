"""Vehicles, exact stops and other schemes that cases and tests of braking share."""
