"""Motion recovered from accelerometers (Section 3.1): exact for clean readings; effect of sensors in a plane, of noise,
and of loose mounts."""

from pathlib import Path

import numpy as np

from models.core.noise import ACCELEROMETERS, normal_samples
from models.drift.score import root_mean_square
from models.engines.protocol import build
from models.sensors.rate_filter import filter_rates
from models.sensors.rigid_body_motion import (
    BodyStartState,
    angular_acceleration,
    body_rotation_from_readings,
    fit_quality,
    integrate_rates,
    rates_up_to_sign,
    recovered_motion,
    tilt_displacement,
)
from models.sensors.rotations import skew_matrix
from models.sensors.sensor_array import SensorArray, sensor_array
from models.systems.pitch_plane.effects.accelerometers import readings_of
from models.systems.pitch_plane.run import run as simulate
from models.systems.pitch_plane.scene import assembly_of_scene, settings_of
from models.systems.pitch_plane.scene import build as build_scene
from validation.common.bands import mean_square
from validation.common.rows import CaseAnswer, Drawn, Observed, Row, Saved, System, Table, behaviour_row
from validation.common.scenes import on_paper_road
from validation.hard_cases.case import IMPLEMENTATIONS
from validation.spatial.spatial_motion import PATH, SENSOR_ARRANGEMENTS, tilted_sensors
from validation.spatial.spatial_motion import sensor_readings as readings_on_path

TITLE = "Motion from accelerometers"
SYSTEM: System = "drift"
SEED = 30
CLOSED_FORM_BOUND = 1e-12
NOISE_GAINS_BY_HEIGHT = {1.0: 0.69, 0.3: 1.9, 0.1: 5.8, 0.03: 18.9}
"""Height (m) of the fifth sensor above a floor of 2 m by 1.2 m, with the known noise gain relative to the last sensor
(1/m)."""
NOISE_DEVIATION = 0.3
"""Standard deviation (m/s^2) of the noise on each sample in the drift rows."""
SAMPLE_PERIOD = 0.01
RIGID_SENSORS = {
    "front left": (1.1, -0.6, 0.2),
    "front right": (1.1, 0.6, 0.2),
    "rear left": (-0.9, -0.6, 0.2),
    "rear right": (-0.9, 0.6, 0.2),
    "roof": (0.1, 0.0, -0.9),
}
"""Positions (m) of rigidly mounted sensors."""
LOOSE_SENSOR = {"x": 0.6, "y": 0.3, "z": 0.0, "bracket": {"frequency": 30.0, "damping": 0.05}}
"""Position (m) of a sensor on a bracket, with frequency (Hz) and damping ratio of the bracket."""


@on_paper_road()
def measure(quick: bool, work_folder: Path) -> CaseAnswer:
    """Rows of clean motions in space, noise, each engine's simulated readings, and drift; a quick run has few paths and
    runs of 1 s."""
    rows = [row for name in SENSOR_ARRANGEMENTS for row in _clean_reading_rows(name)]
    rows += [_formula_as_printed_row(), _convergence_order_row(), _tilt_error_row()]
    gains, gain_rows = _noise_gain_rows(4000 if quick else 40_000)
    rows += gain_rows
    for engine in IMPLEMENTATIONS:
        rows += _engine_rows(engine, 1.0 if quick else 5.0)
    walked, curves = _random_walk_rows(20 if quick else 300)
    return [*rows, *walked, *_symmetric_part_rows(curves, quick)], {"gains": gains, "curves": curves}


def _clean_reading_rows(arrangement_name: str) -> list[Row]:
    """Rows: errors of quantities that need no integration, on a motion whose derivatives are known in closed form."""
    array = sensor_array(SENSOR_ARRANGEMENTS[arrangement_name])
    clean = readings_on_path(array.positions)
    spins, key = (
        body_rotation_from_readings(array, clean),
        f"motion.exact.{arrangement_name.replace(',', '').replace(' ', '-')}",
    )
    alpha = float(np.abs(angular_acceleration(spins, PATH.rates) - PATH.alpha).max())
    squares = (rates_up_to_sign(spins) @ array.principal_axes) ** 2 - (PATH.rates @ array.principal_axes) ** 2
    what = f"sensors: {arrangement_name}{', formula for a plane' if array.is_planar else ''}"
    why = "rounding of readings of 20 m/s^2; nothing is integrated"
    shown = (
        ("alpha", "error of the angular acceleration from clean readings", alpha, "rad/s^2"),
        (
            "rates",
            "error of the squares of the rates from the symmetric part",
            float(np.abs(squares).max()),
            "rad^2/s^2",
        ),
        (
            "consistency",
            "share of the readings that no rigid body explains",
            fit_quality(array, clean).unexplained_share,
            "",
        ),
    )
    return [
        Observed(f"{key}.{id}", SYSTEM, f"{words}, {what}", value, unit).at_most(CLOSED_FORM_BOUND, why, "closed form")
        for id, words, value, unit in shown
    ]


def _formula_as_printed_row() -> Row:
    """Row: angular acceleration by eq. (18) exactly as printed, which is wrong if all sensors lie in a plane."""
    floor = np.array(list(SENSOR_ARRANGEMENTS["5 in a plane"].values()))
    relative = readings_on_path(floor) - readings_on_path(floor).mean(axis=1, keepdims=True)
    m = np.swapaxes(relative, 1, 2) @ np.linalg.pinv((floor - floor.mean(axis=0)).T)
    plain = 0.5 * (m[:, 2, 1] - m[:, 1, 2])
    half = 0.5 * (PATH.alpha[:, 0] + PATH.rates[:, 1] * PATH.rates[:, 2])
    return Observed(
        "motion.plain",
        SYSTEM,
        "difference of the roll acceleration by eq. (18) as printed from (alpha1 + w2 w3) / 2, sensors in a plane",
        float(np.abs(plain - half).max()),
        "rad/s^2",
    ).at_most(
        CLOSED_FORM_BOUND,
        "half of the true value plus a bias, without a word: this is why planes are detected",
        "closed form",
    )


def _convergence_order_row() -> Row:
    """Row: order of convergence in the sampling period of the position recovered from the readings."""
    array = sensor_array(SENSOR_ARRANGEMENTS["5 in a tilted plane"])
    clean = readings_on_path(array.positions)
    errors = [
        float(
            np.abs(recovered_motion(array, clean[::n], n * PATH.period, PATH.start).position - PATH.position[::n]).max()
        )
        for n in (40, 20)
    ]
    return Observed(
        "motion.order",
        SYSTEM,
        "observed order of the recovered position in the sampling period, 40 and 20 ms",
        float(np.log2(errors[0] / errors[1])),
        "",
    ).within(4.0, 0.4, "cubics through four neighbours and a fourth-order step of the quaternion", "closed form")


def _tilt_error_row() -> Row:
    """Row: false displacement by an error of the initial tilt, compared with its law."""
    array, tilt, count = sensor_array(SENSOR_ARRANGEMENTS["4"]), 1e-3, 10_001
    still = np.broadcast_to([0.0, 0.0, -9.81], (count, 4, 3))
    drift = -recovered_motion(array, still, 1e-3, BodyStartState.pitched(tilt)).position[:, 0]
    law = tilt_displacement(tilt, 1e-3 * np.arange(count))
    what = (
        f"relative difference of the false displacement after 10 s, {law[-1]:.4f} m, from g sin(tilt) t^2 / 2, "
        "tilt error of 1 mrad"
    )
    worst = float(np.abs(drift - law).max() / law[-1])
    return Observed("motion.tilt", SYSTEM, what, worst, "").at_most(
        1e-10, "a constant is integrated exactly", "closed form"
    )


def _noise_gain_rows(sample_count: int) -> tuple[list[list[float]], list[Row]]:
    """Table and rows: noise of the angular acceleration by Monte Carlo and by its law, for several heights of the fifth
    sensor."""
    rows, lines = [], []
    for i, height in enumerate((*NOISE_GAINS_BY_HEIGHT, 0.0)):
        line = [height]
        for formula in ("spatial", "plane") if height else ("plane",):
            array = sensor_array(tilted_sensors(height, np.eye(3)), formula)
            noise = normal_samples(SEED, i, sample_count, 15, noise_source=ACCELEROMETERS).reshape(sample_count, 5, 3)
            alpha = angular_acceleration(body_rotation_from_readings(array, noise), np.zeros((sample_count, 3)))
            axis = int(np.argmax(array.noise_gains()))
            law, variance = float(array.noise_gains()[axis] ** 2), float(np.mean(alpha[:, axis] ** 2))
            key = f"motion.gain.{formula}.{height:g}"
            rows.append(
                mean_square(
                    Observed(
                        key,
                        SYSTEM,
                        f"variance of the {('roll', 'pitch', 'yaw')[axis]} acceleration per "
                        f"unit variance of the readings, fifth sensor {height:g} m up, {formula} formula",
                        variance,
                        "1/m^2",
                    ),
                    law,
                    sample_count,
                    f"{sample_count:,} samples; gain {law**0.5:.3g} 1/m",
                )
            )
            line += [law**0.5, variance**0.5]
        if height in NOISE_GAINS_BY_HEIGHT:
            rows.append(
                Observed(
                    f"motion.known_gain.{height:g}",
                    SYSTEM,
                    f"largest noise gain of the plain formula, fifth sensor {height:g} m up",
                    line[1],
                    "1/m",
                ).within(
                    NOISE_GAINS_BY_HEIGHT[height],
                    0.04 * NOISE_GAINS_BY_HEIGHT[height],
                    "figures relative to the last sensor; relative to the mean up to 3 % less",
                    "published",
                )
            )
        lines.append(line)
    return lines, rows


def _engine_rows(engine_name: str, duration: float) -> list[Row]:
    """Rows: motion recovered from five rigid sensors in an engine's run on the study road, and detection of a loose
    sixth sensor."""
    sensors = {name: dict(zip("xyz", place, strict=True)) for name, place in RIGID_SENSORS.items()} | {
        "battery": LOOSE_SENSOR
    }
    scene = build_scene(
        {
            "title": TITLE,
            "run": {"duration": duration, "step": 1e-3},
            "effects": {
                "road": {"source": "study", "speed": 20.0},
                "gyro": {"sampling_rate": 1000.0, "deviation": 0.0},
                "accelerometers": {"sampling_rate": 1000.0, "sensors": sensors},
            },
        }
    )
    run, p = simulate(scene, engine_name), scene.effects["accelerometers"]
    readings, array = readings_of(run, p), sensor_array(RIGID_SENSORS)
    felt = readings[:, :5]
    turning = run["gyro"][:, None] * [0.0, 1.0, 0.0]
    acceleration = angular_acceleration(body_rotation_from_readings(array, felt), turning)[:, 1]
    equations = build("reference", assembly_of_scene(scene), settings_of(scene, "reference"))  # eq. (38) at every state
    true = np.array([equations.acceleration(t, *np.split(y, 2))[3] for t, y in zip(run.times, run.states, strict=True)])
    loose = fit_quality(sensor_array(p.positions()), readings)
    return [
        *_recovered_motion_rows("accelerometers", engine_name, array, felt, run.states, None),
        *_recovered_motion_rows("gyro", engine_name, array, felt, run.states, turning),
        Observed(
            f"motion.pitch_acceleration.{engine_name}",
            SYSTEM,
            f"largest difference of the pitch acceleration from {engine_name}'s readings from the paper's "
            "equations, over the largest value",
            float(np.abs(acceleration - true).max() / np.abs(true).max()),
            "",
        ).at_most(
            CLOSED_FORM_BOUND,
            "the engine's acceleration beside eq. (38), as in the build audit",
            "shared kernel" if engine_name == "reference" else "native",
        ),
        behaviour_row(
            f"motion.bracket.{engine_name}",
            SYSTEM,
            f"six sensors, of which a bracket of 30 Hz carries one, {engine_name}: {100 * loose.unexplained_share:.2g} "
            "% fits no rigid body",
            f"loose: {loose.suspect_sensor}" if not loose.rigid else "rigid",
            "loose: battery",
            "more than 5 % is a loose mount; the one without which it passes is named",
            "closed form",
        ),
        Observed(
            f"motion.rigid.{engine_name}",
            SYSTEM,
            f"share of the readings that no rigid body explains, five rigid mounts, {engine_name}",
            fit_quality(array, felt).unexplained_share,
            "",
        ).at_most(CLOSED_FORM_BOUND, "rounding: far below the 5 % at which a mount is called loose", "closed form"),
    ]


def _recovered_motion_rows(
    integration_rule: str,
    engine_name: str,
    sensor_arrangement: SensorArray,
    specific_forces: np.ndarray,
    states: np.ndarray,
    gyro_rates: np.ndarray | None,
) -> list[Row]:
    """Rows: errors of pitch and heave recovered from noise-free readings of a run, with or without its gyro, compared
    with its states (n, 8)."""
    followed = recovered_motion(
        sensor_arrangement,
        specific_forces,
        1e-3,
        BodyStartState.pitched(*states[0, [3, 7, 2, 6]].tolist()),
        rates=gyro_rates,
    )
    errors = (
        ("pitch", followed.angles()[:, 1] - states[:, 3], "rad", 1e-6),
        ("heave", followed.position[:, 2] - states[:, 2], "m", 1e-5),
    )
    words = "accelerometers alone" if gyro_rates is None else "accelerometers and a gyro"
    return [
        Observed(
            f"motion.recovered.{integration_rule}.{what}.{engine_name}",
            SYSTEM,
            f"error of the {what} recovered from {words}, {engine_name}, {len(states) / 1e3:.0f} s at 1 kHz without "
            "noise",
            float(np.abs(error).max()),
            unit,
        ).at_most(bound, "cubics through samples of 1 ms, across wheel modes of 700 1/s", "closed form")
        for what, error, unit, bound in errors
    ]


def _turning_body(sample_count: int) -> tuple[np.ndarray, SensorArray, np.ndarray]:
    """A body that turns all the time: true angular rates (n, 3) in rad/s, sensor array, and noise-free readings (n,
    sensors, 3) without gravity."""
    t = SAMPLE_PERIOD * np.arange(sample_count)
    rates = np.column_stack([0.5 * np.sin(2 * t), 0.4 * np.cos(1.3 * t), 0.3 + 0.1 * np.sin(t)])
    alpha = np.column_stack([np.cos(2 * t), -0.52 * np.sin(1.3 * t), 0.1 * np.cos(t)])
    array = sensor_array(SENSOR_ARRANGEMENTS["5, one 1 m up"])
    return (
        rates,
        array,
        np.einsum("nij,sj->nsi", skew_matrix(alpha) + skew_matrix(rates) @ skew_matrix(rates), array.positions),
    )


def _noise_samples(noise_path: int, sample_count: int) -> np.ndarray:
    """Noise (n, 5, 3) in m/s^2 on the readings of five sensors."""
    return NOISE_DEVIATION * normal_samples(
        SEED + 1, noise_path, sample_count, 15, noise_source=ACCELEROMETERS
    ).reshape(sample_count, 5, 3)


def _random_walk_rows(noise_path_count: int) -> tuple[list[Row], dict[str, list[float]]]:
    """Row and curves: if angular rates are only integrated from noisy readings, their error grows with the square root
    of time."""
    count, array = 6001, sensor_array(SENSOR_ARRANGEMENTS["5, one 1 m up"])
    errors = np.array(
        [
            integrate_rates(body_rotation_from_readings(array, _noise_samples(path, count)), SAMPLE_PERIOD, np.zeros(3))
            for path in range(noise_path_count)
        ]
    )
    row = mean_square(
        Observed(
            "motion.walk",
            SYSTEM,
            "ratio of the rate error's mean square to its gain after 60 s of integration alone",
            float(np.mean((errors[:, -1] / array.noise_gains()) ** 2)),
            "m^2/s^2",
        ),
        NOISE_DEVIATION**2 * SAMPLE_PERIOD * (count - 1) * SAMPLE_PERIOD,
        3 * noise_path_count,
        f"{noise_path_count} paths of {NOISE_DEVIATION:g} m/s^2 at 100 Hz, three axes: a random walk, noise^2 period "
        "time",
    )
    curves = {
        "time": SAMPLE_PERIOD * np.arange(count),
        "integrated": np.sqrt(np.mean(errors**2, axis=(0, 2))),
        "law": NOISE_DEVIATION * root_mean_square(array.noise_gains()) * np.sqrt(SAMPLE_PERIOD**2 * np.arange(count)),
    }
    return [row], {name: curve[::25].tolist() for name, curve in curves.items()}


def _symmetric_part_rows(error_curves: Saved, quick: bool) -> list[Row]:
    """Rows: if the symmetric part of the angular matrix serves as a measurement, the rate error stays bounded."""
    count, paths = (1001, 1) if quick else (6001, 8)
    rates, array, clean = _turning_body(count)
    filtered = [
        filter_rates(
            body_rotation_from_readings(array, clean + _noise_samples(path, count)),
            SAMPLE_PERIOD,
            rates[0],
            NOISE_DEVIATION,
        )
        for path in range(paths)
    ]
    squares = np.mean([np.mean((held_rates - rates) ** 2, axis=1) for held_rates, _ in filtered], axis=0)
    stated = np.sqrt(np.mean(filtered[0][1] ** 2, axis=1))
    error_curves["held"], error_curves["stated"] = np.sqrt(squares)[::25].tolist(), stated[::25].tolist()
    walked = (
        NOISE_DEVIATION * root_mean_square(array.noise_gains()) * np.sqrt(SAMPLE_PERIOD * (count - 1) * SAMPLE_PERIOD)
    )
    late, early = (
        float(np.sqrt(np.mean(squares_part)))
        for squares_part in (squares[-count // 3 :], squares[count // 6 : count // 3])
    )
    why = (
        f"{paths} paths of {SAMPLE_PERIOD * (count - 1):g} s, {NOISE_DEVIATION:g} m/s^2 at 100 Hz; filterpy's extended "
        "Kalman filter"
    )
    rows = [
        Observed(
            "motion.held",
            SYSTEM,
            "ratio of the rate error with the symmetric part as a measurement, rms of the last "
            "third, to that of integration alone at the end",
            late / walked,
            "",
        ).at_most(0.8 if quick else 0.2, why, "closed form"),
        Observed(
            "motion.held.stated",
            SYSTEM,
            "ratio of the rate error with the symmetric part as a measurement to the standard "
            "deviation that the filter states",
            late / root_mean_square(stated[-count // 3 :]),
            "",
        ).within(1.0, 0.5 if quick else 0.2, f"{why}; it neglects that the readings are used twice", "closed form"),
    ]
    if quick:  # too short to tell growth from settling
        return rows
    what, why = (
        "ratio of the rms rate error in the last third to that in the second sixth",
        f"{why}; integration alone would grow by 1.8",
    )
    return [*rows, Observed("motion.held.growth", SYSTEM, what, late / early, "").within(1.0, 0.2, why, "closed form")]


def tables(case_data: Saved) -> list[Table]:
    """Table of the noise gain of sensors that lie nearly in one plane."""
    rows = tuple(
        (f"{height:g}", *(("half and a bias", "") if len(gains) == 2 else ()), *(f"{value:.3g}" for value in gains))
        for height, *gains in case_data["gains"]
    )
    note = (
        "Four sensors at the corners of a floor of 2 m by 1.2 m, a fifth above its middle: standard deviation of "
        "the worse of roll and pitch acceleration per unit of the readings' (1/m), by law and by Monte Carlo. The "
        "formula for a plane is exact at every height; below a flatness of 0.1 it is taken, and said to be."
    )
    heads = ("height [m]", "plain formula", "Monte Carlo", "formula for a plane", "Monte Carlo")
    return [Table("What sensors in nearly one plane cost", note, heads, rows)]


def draw(case_data: Saved) -> Drawn:
    """Plot the noise gain over the sensor's height, and the error of the angular rate over time."""
    from models.drawing.figures import COLUMN_WIDTH, add_heading, subplots

    figure, (left, right) = subplots(1, 2, figsize=(COLUMN_WIDTH, 3.9))
    heights = np.geomspace(0.02, 1.2, 40)
    for formula, label in (("spatial", "plain formula"), ("plane", "formula for a plane")):
        arrays = [sensor_array(tilted_sensors(float(height), np.eye(3)), formula) for height in heights]  # type: ignore[arg-type]
        left.loglog(heights, [array.noise_gains().max() for array in arrays], label=label)
    height, _, spatial, _, plane = zip(*(line for line in case_data["gains"] if len(line) == 5), strict=True)
    left.plot(height, spatial, "ko", markersize=4, label="Monte Carlo")
    left.plot(height, plane, "ko", markersize=4)
    left.set(
        title="Noise of the angular acceleration\nper noise of the readings [1/m]",
        xlabel="height of the fifth sensor above the others [m]",
    )
    curves = case_data["curves"]
    for key, style, label in (
        ("integrated", "C0-", "integration alone"),
        ("law", "k--", "its law, sqrt(t)"),
        ("held", "C1-", "with the symmetric part"),
        ("stated", "C7--", "what the filter states"),
    ):
        right.plot(curves["time"][: len(curves[key])], curves[key], style, label=label, linewidth=1)
    right.set(title="Error of the angular velocity,\nrms [rad/s]", xlabel="time [s]")
    for axis in (left, right):
        axis.legend()
    add_heading(figure, "What a flat arrangement of sensors costs, and what holds the rate")
    return [("What a flat arrangement costs, and what holds the rate", figure)]
