"""Choice of effects by test runs: what each effect of a scene costs and changes, and which ones may be left out within
a tolerance.

    scene -> Variants (less effects, with longer steps) -> Screen (differences, pair by pair) -> Choice (confirmed)

It is one mechanism for the scenes of all systems that are run in time; a file of ``systems`` says how those of one
system are run, shortened and taken in longer steps. Linear stationary scenes of ride have a closed form instead,
``models.advice.ride_choice``.
"""
