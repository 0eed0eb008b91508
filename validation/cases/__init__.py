"""Validation cases, one module for each: the compared quantities, the expected values, the tolerances and their
reasons.

A case module holds

``TITLE``, ``SYSTEM``
    heading, and one of the systems of ``validation.common.rows``
``measure(quick, folder) -> (rows, data)``
    runs what it needs (a named small share of it where ``quick`` is true); ``data`` is saved as JSON
``tables(data) -> [Table]`` and ``draw(data) -> [(caption, Figure)]``, both optional
    what the report shows beside the rows, from the saved data alone: it never simulates

A row that rests on a run which broke an assumption fails; ``validation.common.grounds.allowing_breaches`` says why a
run may.
"""

CASES = (
    "audit",
    "twin",
    "order",
    "tight",
    "enforced_moment",
    "guards",
    "roads",
    "drift_paper",
    "growth",
    "drift_off",
    "drift_solvers",
    "holding_spring",
    "point_mass",
    "lift_off",
    "inertial_unit",
    "motion",
    "stabilisers",
    "index_reduction",
    "kalman",
    "score",
    "hard_cases",
    "planted_faults",
    "absent",
    "effect_prices",
    "price",
    "instruction_counts",
    "stated_errors",
    "recommendation",
    "ensemble",
    "contact_hertz",
    "contact_coefficients",
    "contact_exact",
    "contact_simplified",
    "contact_profiles",
    "manchester",
    "conicity",
    "ride_road",
    "ride_covariance",
    "ride_engines",
    "ride_varying_speed",
    "ride_nonlinear",
    "choice_linear",
    "choice_nonlinear",
    "hub_forces",
    "native_builds",
    "contact_price",
    "fastsim",
    "wheelset",
    "contact_bridges",
    "handling",
    "trailer",
    "bicycle",
    "race_car",
    "measured_drive",
    "written_equations",
    "adams_joints",
    "braking_stop",
    "braking_limits",
    "braking_port",
    "braking_controllers",
    "braking_engines",
    "braking_suspension",
    "braking_trailer",
    "braking_relaxation",
    "braking_reference",
    "twin_files",
    "own_car",
    "measured_formats",
    "measured_virtual",
    "measured_long",
    "measured_checks",
)
"""Case modules in the order of the report."""
