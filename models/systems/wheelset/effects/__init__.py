"""Effects of scenes of a wheelset, one file each: see ``models.core.scene_effects``.

Counts are those of a wheelset in an implementation: its springs and dampers, tables of profiles, calls of FASTSIM.
"""
