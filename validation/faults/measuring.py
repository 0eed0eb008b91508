"""Faults planted in noise, sensors, units, resampling, cycle counting, section forces and roads, and the checks that
see them."""

from collections.abc import Callable
from functools import cache
from itertools import combinations
from typing import Any

import numpy as np

from models.core import noise
from models.drift import score
from models.fatigue import counting, damage
from models.measured import resampling, units
from models.road import iso8608
from models.sensors import rigid_body_motion as body
from models.sensors.rotations import quaternion_from_cardan, rotation_matrix
from models.sensors.sensor_array import SensorArray, sensor_array, specific_forces_on_body
from validation.common.checks import largest_relative_difference
from validation.faults.campaign import Campaign, CampaignFault, Check
from validation.faults.patches import Patch, attribute_patch

STANDARD_LOAD = np.array([-2.0, 1.0, -3.0, 5.0, -1.0, 3.0, -4.0, 4.0, -2.0])
"""Load history of figure 6 in ASTM E1049-85, whose cycles are printed there."""
PRINTED_CYCLES = {3.0: 0.5, 4.0: 1.5, 6.0: 0.5, 8.0: 1.0, 9.0: 0.5}
"""Range of a cycle in that load history -> printed number of cycles."""
SENSOR_PLACES = {"a": (1.2, 0.3, 0.1), "b": (-0.9, 0.5, 0.4), "c": (0.2, -0.8, -0.3), "d": (0.1, 0.2, 0.9)}
SAMPLE_PERIOD, SAMPLE_COUNT = 5e-3, 400
UNIT_FACTORS = {
    ("kN", "force"): 1e3,
    ("deg/s", "angular rate"): np.pi / 180,
    ("g", "acceleration"): 9.80665,
    ("mm", "travel"): 1e-3,
    ("N m", "moment"): 1.0,
}


def _stream_correlation() -> float:
    """Largest correlation between the noise streams of two paths and two sources, in standard errors."""
    streams = [
        noise.normal_samples(3, path, noise.SAMPLES_PER_BLOCK, 1, noise_source=source)[:, 0]
        for path in (0, 1)
        for source in (noise.FORCES, noise.GYRO)
    ]
    return max(
        abs(float(first @ second_stream)) / noise.SAMPLES_PER_BLOCK**0.5
        for first, second_stream in combinations(streams, 2)
    )


def _variance_error() -> float:
    """Difference of a noise stream's variance from 1, in standard errors."""
    stream = noise.normal_samples(3, 0, noise.SAMPLES_PER_BLOCK, 1)
    return abs(float(np.mean(stream**2)) - 1.0) * (noise.SAMPLES_PER_BLOCK / 2.0) ** 0.5


def _stream_difference() -> float:
    """Largest difference between a noise stream read in two pieces and read at once."""
    parts = [noise.normal_samples(3, 0, 50, 1, first_sample=first) for first in (0, 50)]
    return float(np.abs(np.concatenate(parts) - noise.normal_samples(3, 0, 100, 1)).max())


def _damage_error() -> float:
    """Largest relative error of the damage of the standard's load at Wöhler slopes 1 and 5, against the damage of its
    printed cycles."""
    return max(
        abs(
            damage.pseudo_damage(STANDARD_LOAD, slope) / sum(n * size**slope for size, n in PRINTED_CYCLES.items())
            - 1.0
        )
        for slope in (1.0, 5.0)
    )


def _range_pair_error() -> float:
    """Relative error of the range-pair counts of the standard's load, against its printed cycles."""
    counts = counting.range_pairs(
        np.array(list(PRINTED_CYCLES)), np.array(list(PRINTED_CYCLES.values())), np.array([3.5, 4.0, 8.5])
    )
    return largest_relative_difference(counts, np.array([3.5, 3.5, 0.5]))


def _crossing_error() -> float:
    """Relative error of the level crossings of the standard's load at 0, 2 and 4.5, against counts by hand."""
    return largest_relative_difference(
        counting.level_crossings(STANDARD_LOAD, np.array([0.0, 2.0, 4.5])), np.array([4.0, 3.0, 1.0])
    )


def _unit_errors() -> float:
    """Largest relative error of the unit conversion factors in UNIT_FACTORS."""
    return max(
        abs(units.factor_to_si(unit, quantity, "", "") / wanted - 1.0)  # type: ignore[arg-type]
        for (unit, quantity), wanted in UNIT_FACTORS.items()
    )


def _resampling_error() -> float:
    """Largest error, divided by the amplitude, of a 2 Hz sine resampled from 200 Hz and from 4 kHz to 1 kHz."""
    grid, worst = np.arange(1000) / 1000.0 + 0.2, 0.0
    for rate in (200.0, 4000.0):
        sample_times = np.arange(round(1.5 * rate)) / rate
        values = resampling.resample_to(sample_times, np.sin(4 * np.pi * sample_times), 1.0 / rate, grid)
        worst = max(worst, float(np.abs(values - np.sin(4 * np.pi * grid)).max()))
    return worst


def _points_in_gap() -> float:
    """Number of resampled points inside a gap of nine missing samples that are finite; it should be 0."""
    sample_times = np.delete(np.arange(100) / 100.0, np.arange(40, 49))
    values = resampling.resample_to(sample_times, sample_times, 0.01, np.arange(41, 48) / 100.0)
    return float(np.isfinite(values).sum())


def _section_force_error() -> float:
    """Relative error of the section forces in the body's axes for an upward force, at pitch angles of 90 and 30
    degrees."""
    forces = score.section_forces(np.array([100.0, 200.0]), np.array([50.0, 0.0]), np.array([np.pi / 2, np.pi / 6]))
    have = np.concatenate([forces[name] for name in score.SECTION_FORCE_CHANNELS])
    return largest_relative_difference(have, np.array([100.0, 100.0, 0.0, 200.0 * 3**0.5 / 2, 50.0, 0.0, 0.0, 0.0]))


@cache
def _turning_body() -> tuple[SensorArray, np.ndarray, np.ndarray, np.ndarray]:
    """Accelerometers on a body that pitches and heaves: sensor array, readings (n, 4, 3) in m/s^2, pitch (n,) in rad
    and vertical acceleration (n,) in m/s^2."""
    t = SAMPLE_PERIOD * np.arange(SAMPLE_COUNT)
    pitch, rate, turn = (0.3 * np.sin(2 * t), 0.6 * np.cos(2 * t), -1.2 * np.sin(2 * t))
    heave = 2.0 * np.cos(3 * t)
    no_angles = np.zeros(SAMPLE_COUNT)
    S = rotation_matrix(quaternion_from_cardan(no_angles, pitch, no_angles))
    felt = np.einsum("nji,nj->ni", S, np.column_stack([no_angles, no_angles, heave - 9.81]))
    w, alpha = (np.column_stack([no_angles, component, no_angles]) for component in (rate, turn))
    return (
        sensor_array(SENSOR_PLACES),
        specific_forces_on_body(np.array(list(SENSOR_PLACES.values())), felt, w, alpha),
        pitch,
        heave,
    )


def _recovered_motion_error() -> float:
    """Relative error of the pitch rate and vertical acceleration recovered from the readings of accelerometers on a
    moving body; the larger of both."""
    array, read, _, heave = _turning_body()
    moved_body = body.recovered_motion(array, read, SAMPLE_PERIOD, body.BodyStartState(rates=(0.0, 0.6, 0.0)))
    rate = 0.6 * np.cos(2 * SAMPLE_PERIOD * np.arange(SAMPLE_COUNT))
    return max(
        largest_relative_difference(moved_body.rates[:, 1], rate),
        largest_relative_difference(moved_body.acceleration[:, 2], heave),
    )


def _unexplained_share() -> float:
    """Share of the accelerometers' readings that no rigid-body motion explains."""
    array, read, *_ = _turning_body()
    return body.fit_quality(array, read).unexplained_share


def _road_variance_error() -> float:
    """Relative error of the variance of a class C road, against the standard's spectral density integrated by hand."""
    road = iso8608.iso8608_road("C", 1, waves=400)
    wanted = 256e-6 * 0.1**2 * (1.0 / 0.011 - 1.0 / 2.83)
    return abs(0.5 * float(np.sum(road.amplitude**2)) / wanted - 1.0)


def _road_level_error() -> float:
    """Relative error of the two-sided spectral level of a class C road over rad/m, against pi n0^2 Gd."""
    return abs(iso8608.level_of_class("C") / (np.pi * 0.01 * 256e-6) - 1.0)


CHECKS = {
    "streams": Check("streams of two paths and sources are uncorrelated", "standard errors", 4.5, _stream_correlation),
    "variance": Check("variance of a stream is 1", "standard errors", 4.5, _variance_error),
    "pieces": Check("a stream in pieces is the whole", "", 1e-15, _stream_difference),
    "damage": Check("damage by the cycles that the standard prints", "relative", 1e-12, _damage_error),
    "pairs": Check("range pairs by the same", "of the largest", 1e-12, _range_pair_error),
    "crossings": Check("crossings counted by hand", "of the largest", 1e-12, _crossing_error),
    "units": Check("factors of units", "relative", 1e-12, _unit_errors),
    "clock": Check("sines of two rates onto one clock", "of the amplitude", 1e-3, _resampling_error),
    "gap": Check("numbers within a gap", "samples", 0.5, _points_in_gap),
    "sections": Check("forces along a turned body", "of the largest", 1e-12, _section_force_error),
    "motion": Check("rate and acceleration from accelerometers", "of the largest", 1e-4, _recovered_motion_error),
    "rigid": Check("a rigid body is found rigid", "share", 1e-9, _unexplained_share),
    "road": Check("variance of a road of class C", "relative", 1e-9, _road_variance_error),
    "levels": Check("two-sided level of class C", "relative", 1e-9, _road_level_error),
}


def _noise_block_patch(change_arguments: Callable[..., tuple[int, ...]]) -> Patch:
    """Fault: noise blocks are generated for changed values of (seed, path, block, channels, source)."""
    return attribute_patch(
        "models.core.noise:normal_block",
        lambda real: (
            lambda seed, path, block, channels, source=0, **rows: real(
                *change_arguments(seed, path, block, channels, source), **rows
            )
        ),
    )


def _change_resampling(
    delay_periods: float = 0.0, change_samples: Callable[[np.ndarray], np.ndarray] = np.asarray
) -> Patch:
    return attribute_patch(
        "models.measured.resampling:resample_to",
        lambda real: (
            lambda times, values, period, grid: change_samples(
                real(times + delay_periods * period, values, period, grid)
            )
        ),
    )


def _factor_patch(unit_name: str, factor: float) -> Patch:
    return attribute_patch(
        "models.measured.units:factor_to_si",
        lambda real: lambda unit, *arguments: real(unit, *arguments) * (factor if unit == unit_name else 1.0),
    )


def _change_rainflow(change_cycles: Callable[[Any], Any]) -> Patch:
    """Fault: ranges, means and counts of rainflow cycles are changed."""
    return attribute_patch(
        "models.fatigue.rainflow_cycles:rainflow_cycles", lambda real: lambda turns: change_cycles(real(turns))
    )


def _readings_patch(change_readings: Callable[[np.ndarray], np.ndarray]) -> Patch:
    """Fault: the sensors' readings (n, 4, 3) are changed before motion is computed from them."""
    return attribute_patch(
        "models.sensors.rigid_body_motion:body_rotation_from_readings",
        lambda real: (
            lambda array, readings: real(
                array, change_readings(readings) if readings.shape[1] == len(SENSOR_PLACES) else readings
            )
        ),
    )


def _second_sensor_scaled(sensor_readings: np.ndarray) -> np.ndarray:
    return sensor_readings * np.array([1.0, 1.01, 1.0, 1.0])[:, None]


def _crossings_both_ways(original_function: Any) -> Any:
    return lambda load, levels: (
        original_function(load, levels) + original_function(-np.asarray(load), -np.asarray(levels)[::-1])[::-1]
    )


FAULTS = (
    CampaignFault("paths share one stream", "noise", _noise_block_patch(lambda s, p, b, c, o: (s, 0, b, c, o))),
    CampaignFault(
        "gyro and forces share one stream", "noise", _noise_block_patch(lambda s, p, b, c, o: (s, p, b, c, 0))
    ),
    CampaignFault(
        "deviation for variance",
        "noise",
        attribute_patch(
            "models.core.noise:normal_block", lambda real: lambda *path, **rows: real(*path, **rows) * 2.0**0.5
        ),
    ),
    CampaignFault(
        "stream begins anew at every call",
        "noise",
        attribute_patch(
            "models.core.noise:normal_samples",
            lambda real: lambda s, p, n, c, first_sample=0, noise_source=0: real(s, p, n, c, noise_source=noise_source),
        ),
    ),
    CampaignFault(
        "residue counted as whole cycles",
        "counting",
        _change_rainflow(lambda cycles: (cycles[0], cycles[1], np.ceil(cycles[2]))),
    ),
    CampaignFault(
        "residue lost", "counting", _change_rainflow(lambda cycles: (cycles[0], cycles[1], np.floor(cycles[2])))
    ),
    CampaignFault(
        "amplitude for range", "counting", _change_rainflow(lambda cycles: (cycles[0] / 2.0, cycles[1], cycles[2]))
    ),
    CampaignFault(
        "pairs beyond a range, not from it on",
        "counting",
        attribute_patch(
            "models.fatigue.counting:range_pairs",
            lambda real: lambda spans, counts, ranges: real(spans, counts, ranges * (1.0 + 1e-9)),
        ),
    ),
    CampaignFault(
        "levels crossed either way",
        "counting",
        attribute_patch("models.fatigue.counting:level_crossings", _crossings_both_ways),
    ),
    CampaignFault("kN taken for N", "units", _factor_patch("kN", 1e-3)),
    CampaignFault("degrees taken for rad", "units", _factor_patch("deg/s", 180.0 / np.pi)),
    CampaignFault("g of 9.81 m/s^2", "units", _factor_patch("g", 9.81 / 9.80665)),
    CampaignFault("sign of one channel", "units", _factor_patch("mm", -1.0)),
    CampaignFault("a sample late", "clock", _change_resampling(1.0)),
    CampaignFault("half a sample late", "clock", _change_resampling(0.5)),
    CampaignFault(
        "gaps bridged",
        "clock",
        attribute_patch(
            "models.measured.resampling:_unknown_points",
            lambda real: lambda times, *others: np.zeros(7, dtype=bool) if len(times) < 100 else real(times, *others),
        ),
    ),
    CampaignFault(
        "section forces in the inertial frame",
        "sections",
        attribute_patch(
            "models.drift.score:section_forces", lambda real: lambda f3, f4, pitch: real(f3, f4, 0.0 * pitch)
        ),
    ),
    CampaignFault(
        "body turned the other way",
        "sections",
        attribute_patch("models.drift.score:section_forces", lambda real: lambda f3, f4, pitch: real(f3, f4, -pitch)),
    ),
    CampaignFault(
        "front and rear sections exchanged",
        "sections",
        attribute_patch("models.drift.score:section_forces", lambda real: lambda f3, f4, pitch: real(f4, f3, pitch)),
    ),
    CampaignFault(
        "gravity turned round",
        "motion",
        attribute_patch("models.sensors.rigid_body_motion:GRAVITY", lambda real: -real),
    ),
    CampaignFault("readings of two sensors exchanged", "motion", _readings_patch(lambda read: read[:, [1, 0, 2, 3]])),
    CampaignFault("one sensor 1 % off", "motion", _readings_patch(_second_sensor_scaled)),
    CampaignFault(
        "lever of the sensors left out",
        "motion",
        attribute_patch(
            "models.sensors.rigid_body_motion:reference_acceleration",
            lambda real: lambda a, r, o, alpha, w, down: real(a, r, o, 0.0 * alpha, 0.0 * w, down),
        ),
    ),
    CampaignFault(
        "two-sided density for one-sided",
        "road",
        attribute_patch("models.road.iso8608:FACTOR_TO_ONE_SIDED", lambda real: {**real, "one-sided": 2.0}),
    ),
    CampaignFault(
        "class D for C",
        "road",
        attribute_patch("models.road.iso8608:DENSITY_OF_CLASS", lambda real: {**real, "C": real["D"]}),
    ),
)

CAMPAIGN_SUBJECT = "noise, sensors, units, clocks, counting and roads"
CAMPAIGN = Campaign("planted.measuring", CAMPAIGN_SUBJECT, "measured", CHECKS, FAULTS)
