"""How scenes of each system are run for a price or a choice of effects: one file per system, looked up by the system's
name.

A file has ``DEFAULT_ENGINE``, the implementation that is used where the user names none; ``computed_quantities(scene,
engine, with_error_estimate=False)``, which runs the scene, with an estimate of its error on request, and raises
RunFailed or InputError where the scene cannot be run; ``step_count(scene)``, the largest number of steps of a run, and
``divisible_step_count(scene)``, the number of steps that a longer step must divide, 1 where steps cannot be changed;
``PART_REPRESENTS_RUN``, whether a part of the run represents all of it; and two edits of a scene's table:
``shorten_run(scene_table, scene, step_count)``, to so many steps, and ``lengthen_steps(scene_table, scene,
step_factor)``, to steps longer by this factor.

Where effects lie in files that scenes name, as in a vehicle's, a file has ``copies_of_scene(scene)`` in place of both
edits. It returns the object that ``computed_quantities``, ``step_count`` and ``divisible_step_count`` take. This object
has ``file``, ``system``, the names of its effects ``effect_names`` and of those it could have ``absent_effect_names``,
and a sentence on each effect ``effect_sentences``; it makes variants of itself: ``without(names)``,
``with_effect(name)``, ``in_longer_steps(step_factor)`` and ``with_fewer_copies(steps)``, of about so many steps.
"""
