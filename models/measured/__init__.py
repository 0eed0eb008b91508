"""Measurements: files in four formats, brought onto one clock, checked, and used for runs.

The straight line: files -> ``MeasurementSource`` (what a file says, in its own words) -> channel map -> ``Recording``
(signals in SI on one clock) -> ``Finding`` (what is wrong with it) -> run -> section forces -> files again, and a page.

Axes of the vehicle are those of ISO 8855: x forward, y left, z up, roll, pitch and yaw about them. A force acts on the
vehicle from outside, a moment is about the point named, an acceleration that includes gravity reads +9.81 m/s^2 upwards
at rest. Signs, units and frames of a file are turned into these by the channel map alone.
"""
