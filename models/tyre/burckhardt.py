"""Friction by Burckhardt's formula: mu = c1 (1 - exp(-c2 s)) - c3 s, one curve for both directions.

Figures after M. Burckhardt, Fahrwerktechnik: Radschlupf-Regelsysteme (1993), as many texts quote them; recalled, not
checked against the book.
"""

from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True)
class Burckhardt:
    """c1 is what friction tends to, c2 how fast, c3 how much it falls up to slip 1; beyond that it stays."""

    c1: float
    c2: float
    c3: float

    def __call__(self, slip: np.ndarray) -> np.ndarray:
        """mu at slips from 0 on."""
        least = np.minimum(slip, 1.0)
        return -self.c1 * np.expm1(-self.c2 * least) - self.c3 * least


SURFACES = {
    "dry asphalt": Burckhardt(1.2801, 23.99, 0.52),
    "wet asphalt": Burckhardt(0.857, 33.822, 0.347),
    "dry concrete": Burckhardt(1.1973, 25.168, 0.5373),
    "dry cobble": Burckhardt(1.3713, 6.4565, 0.6691),
    "wet cobble": Burckhardt(0.4004, 33.708, 0.1204),
    "packed snow": Burckhardt(0.1946, 94.129, 0.0646),
    "smooth ice": Burckhardt(0.05, 306.39, 0.0),
}
