"""Effects of scenes of hub forces, one file each: see ``models.scene_effects``.

No counts are kept of such scenes, so that no effect declares any.
"""
