"""Effects of scenes of hub forces, one file each: see ``models.scene_effects``.

Counts are those of what the study prepares before its runs.
"""
