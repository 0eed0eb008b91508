"""Experiments that cases and tests of drift share."""
