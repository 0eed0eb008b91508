"""Fatigue: rainflow cycles, pseudo-damage by Miner's rule, level crossings, range pairs."""
