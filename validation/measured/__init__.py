"""Recordings and measurement files that cases and tests of measured vehicles share."""
