"""How scenes of each system are run for a price or a choice: one file per system, found by its name.

A file has ``ENGINE``, the implementation that is asked where nobody says which; ``computed_quantities(scene, engine,
error=False)``, which runs the scene, with an estimate of its error where that is asked, and raises RunFailed or
InputError where that cannot be; ``steps(scene)``, how many a run has at most, and ``parts(scene)``, of how many a
whole number makes up a run, 1 where steps are not to be changed; ``WINDOWED``, whether a part of the run tells of all
of it; and two edits of a scene's table: ``shorten(table, scene, steps)``, to so many steps, and ``coarsen(table,
scene, times)``, to steps so many times as long.

Where effects lie in files that scenes name, as in a vehicle's, a file has ``opened(scene)`` in place of both edits: it
gives what ``computed_quantities``, ``steps`` and ``parts`` take. That has ``file``, ``system``, names of effects,
``named`` and ``absent``, and what each is, ``said``; and it gives others of its kind: ``without(names)``,
``beside(name)``, ``longer(times)`` and ``fewer(steps)``, of about so many steps.
"""
