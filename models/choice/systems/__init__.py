"""How scenes of each system are run for a price or a choice: one file per system, found by its name.

A file has ``ENGINE``, the implementation that is asked where nobody says which; ``answer(scene, engine)``, which runs
the scene and raises RunFailed or InputError where that cannot be; ``WINDOWED``, whether a part of the run tells of all
of it; and two edits of a scene's table: ``shorten(table, scene, steps)``, to so many steps, and ``coarsen(table, scene,
times)``, to steps so many times as long. ``steps(scene)`` is how many there are; where there are none it is 0.
"""
