"""Effects of scenes of ride, one file each: see ``models.core.scene_effects``. Counts are those of the linear system.

Those that a choice of effects may leave out of a linear scene have found(held) besides: what of the effect the scene's
vehicle and road hold, part by part, such as bar by bar, what leaving it out means, and which others must be left out
with it or may not be (``models.systems.ride.reduced_scene.Effect``).
"""
