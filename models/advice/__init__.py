"""Advice before a simulation is set up: the cheapest solver setting for a tolerance, and the effects that a scene can
do without.
"""
