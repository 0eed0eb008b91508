"""Effects: one file each, named as in a scene and imported only when a scene names it.

An effect file holds ``Parameters`` (what a scene may say), ``NEEDS`` and ``EXCLUDES`` (names of other
effects), ``AFTER`` (effects that come first where both are named), ``COST`` (one sentence), ``CHANNELS``
(names of further results, if it has any) and ``extend(assembly, parameters)``, which returns the assembly
with the effect in it. There is no switch: an effect that is not named is not there.
"""
