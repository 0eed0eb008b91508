"""Effects of scenes of one contact, one file each: see ``models.core.scene_effects``.

The theory of a scene is made of them: linear is that of no effect, FASTSIM that of saturation alone. Counts are those
of what computes: whether forces are bounded, areas of any shape, half-spaces, laws of friction, motions with spin.
"""
