"""Pictures of runs: body shapes, poses over time and forces as arrows; drawn in software, without a display.

The poses are those that an engine itself reports for the states of its run. The drawing is twinrig's own: MuJoCo's
renderer wants OpenGL from the system, which a machine without a screen may lack, Exudyn's has no MuJoCo beside it, and
two engines can only be compared by eye where both are drawn in one way. Any run can be drawn: give its ``Motion`` and
the ``FilmStage`` that it happens on to ``page``.
"""

ENGINES = ("exudyn", "mujoco")
