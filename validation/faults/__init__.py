"""Planted faults: each is put into a model on purpose, and the checks must see it.

For the pitch-plane vehicle ``planting`` lists the faults, ``changes`` alters description and input, ``patches`` alters
adapters and equations, ``bench`` runs the checks, and ``pitch_plane`` reports. Every other module is a ``campaign``.
"""
