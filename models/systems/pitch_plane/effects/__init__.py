"""Effects of the pitch-plane vehicle: a module each, named as in a scene and imported only when a scene names it.

``models.core.scene_effects`` describes the contents of such a module. A scene names an effect by its table, and
``extend(assembly, parameters)`` returns the assembly with the effect. There is no switch: an effect that is not named
is absent.
"""
