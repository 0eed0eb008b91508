"""Vehicles and roads that cases and tests of ride share."""
