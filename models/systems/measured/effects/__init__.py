"""Effects of scenes of a recording, one file each: see ``models.core.scene_effects``."""
