"""How scenes of each system are run for a price or a choice: one file per system, found by its name.

A file has ``ENGINE``, the implementation that is asked where nobody says which; ``answer(scene, engine)``, which runs
the scene and raises RunFailed or InputError where that cannot be; ``steps(scene)``, how many a run has at most, and
``parts(scene)``, of how many a whole number makes up a run, 1 where steps are not to be changed; ``WINDOWED``, whether
a part of the run tells of all of it; and two edits of a scene's table: ``shorten(table, scene, steps)``, to so many
steps, and ``coarsen(table, scene, times)``, to steps so many times as long.
"""
