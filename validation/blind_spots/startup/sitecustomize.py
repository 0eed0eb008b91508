"""Spoils or traces in every process of an audit, its workers too: Python imports this file before all else."""

from validation.blind_spots import planting

planting.start()
