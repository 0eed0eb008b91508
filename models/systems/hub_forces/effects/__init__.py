"""Effects of scenes of hub forces, one file each: see ``models.core.scene_effects``."""
