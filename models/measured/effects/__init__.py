"""Effects of scenes of a recording, one file each: see ``models.scene_effects``."""
