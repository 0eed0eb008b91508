"""Ride vehicles and roads that validation cases and tests share."""
