"""Planted faults: each is put into one side on purpose, and the checks must see it.

Of the pitch plane ``planting`` lists them, ``changes`` alters description and input, ``patches`` alters adapters and
equations, ``bench`` runs the checks on them, ``pitch_plane`` reports. Every other module is a ``campaign``.
"""
