"""Work-precision measurements: the computing cost of accuracy for every integrator.

``problems/`` holds one file per test problem; ``rows``, ``tables`` and ``figure`` show the measured points,
``force_calls`` counts force evaluations independently, ``speed`` times callbacks.
"""
