"""Effects of scenes of hub forces, one file each: see ``models.scene_effects``."""
