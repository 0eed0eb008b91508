"""Braked vehicles, exact stops and independent schemes that the validation cases and tests of braking share."""
