"""Effects of scenes of a recording, one file each: see ``models.scene_effects``.

Counts are those of what the study prepares before its runs.
"""
