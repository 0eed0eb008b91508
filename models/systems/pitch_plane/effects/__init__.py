"""Effects of the pitch-plane vehicle: one file each, named as in a scene and imported only when a scene names it.

What every effect holds is told in ``models.core.scene_effects``. Here a scene names each by its table, and
``extend(assembly, parameters)`` returns the assembly with the effect in it. There is no switch: an effect that is not
named is not there.
"""
