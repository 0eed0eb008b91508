"""Planted faults: each is put into one side on purpose, and the checks must see it.

``planting`` lists them, ``changes`` alters description and input, ``patches`` alters adapters and
equations, ``bench`` runs the checks on them.
"""
