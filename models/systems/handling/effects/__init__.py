"""Effects of scenes of handling, one file each: see ``models.core.scene_effects``.

Counts are those of all manoeuvres: waves of the road, wheels that lean, controls that act, pushes from outside.
"""
