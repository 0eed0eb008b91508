"""The public recording of ``validation.measured.recording``, prepared like a measurement by an engineer:
accelerometers, gyros and angles.

No public recording contains wheel forces. The files contain the static load at each hub instead, so that no computed
force can be judged with them.
"""

from pathlib import Path

import numpy as np
from scipy.spatial.transform import Rotation

from models.measured.columns import SampleFile
from models.measured.recording import Recording
from models.measured.signal import MeasuredSignal, Quantity
from models.sensors.rotations import rotation_matrix
from models.systems.measured.scene import MeasuredScene, build
from models.vehicles.cut_vehicle import CutVehicle
from validation.measured import recording as car

CHANNELS: tuple[tuple[str, Quantity, str], ...] = (
    ("ax", "acceleration", "x"),
    ("ay", "acceleration", "y"),
    ("az", "acceleration", "z"),
    ("p", "angular rate", "roll"),
    ("q", "angular rate", "pitch"),
    ("r", "angular rate", "yaw"),
    ("roll", "angle", "roll"),
    ("pitch", "angle", "pitch"),
)
TELEPHONE_TO_CAR = np.array([1.0, -1.0, -1.0])
"""Signs that turn the telephone's axes (x forward, y right, z down) into the car's (x forward, y left, z up)."""


def samples(recording_path: Path) -> np.ndarray:
    """Samples (n, channels) of the telephone's sensors, and of the roll and pitch angles from its camera, in SI units
    and ISO 8855 axes.

    Roll and pitch are angles to the vertical at the place of the car, which points away from the earth's centre.
    """
    read_car = car.read_recording(recording_path)
    with np.load(recording_path) as data:
        begin, end = (side([data["gyro_t"][i], data["frame_t"][i]]) for side, i in ((max, 0), (min, -1)))
        clock = np.arange(begin, end, car.SAMPLE_PERIOD)
        felt = np.column_stack([np.interp(clock, data["acc_t"], column) for column in data["acc"].T])
        frame_origin = data["frame_p"].mean(axis=0)
    upward = (
        np.einsum("nji,j->ni", rotation_matrix(read_car.pose), frame_origin / np.linalg.norm(frame_origin))
        * TELEPHONE_TO_CAR
    )
    return np.column_stack(
        [
            felt * TELEPHONE_TO_CAR,
            read_car.rates * TELEPHONE_TO_CAR,
            np.arctan2(upward[:, 1], upward[:, 2]),
            -np.arcsin(upward[:, 0]),
        ]
    )


def phone_recording(samples_of_phone: np.ndarray, output_path: Path) -> Recording:
    """A recording object for samples (n, channels). They are written to ``output_path``."""
    columns = SampleFile(output_path, tuple(name for name, *_ in CHANNELS), len(samples_of_phone))
    columns.write(0, samples_of_phone)
    signals = tuple(
        MeasuredSignal(name, "", name, quantity, "body", component, "body", 1, "", 1.0)
        for name, quantity, component in CHANNELS
    )
    return Recording(signals, columns, car.SAMPLE_PERIOD)


def recording_scene(recording_path: Path, vehicle: CutVehicle, scene_folder: Path) -> MeasuredScene:
    """A scene made of the public recording, with three files that have different clocks.

    The signs in its channel table turn the telephone's axes (x forward, y right, z down) into those of ISO 8855.
    """
    scene_folder.mkdir(parents=True)
    with np.load(recording_path) as data:
        start, count = data["acc_t"][0], int((data["acc_t"][-1] - data["acc_t"][0]) * 100)
        camera = Rotation.from_quat(data["frame_q"], scalar_first=True).as_matrix()
        downward = -data["frame_p"] / np.linalg.norm(data["frame_p"], axis=1, keepdims=True)
        forward, right, along_down = np.einsum("nij,ni->jn", camera, downward)
        rates = data["gyro"] - data["gyro_bias"]
        tables = {
            "hubs": (np.arange(count) / 100, [np.full(count, load) for load in vehicle.loads]),
            "camera": (data["frame_t"] - start, [np.arctan2(right, along_down), -np.arcsin(forward)]),
            "phone": (data["acc_t"] - start, [*rates.T, *data["acc"].T]),
        }
    turns, signs = ("roll", "pitch", "yaw"), (1, -1, -1)
    rows: dict[str, list[tuple[str, Quantity, str, str, str, int, str]]] = {
        "hubs": [(f"{hub}_fz", "force", hub, "z", "hub", 1, "N") for hub in vehicle.hubs],
        "camera": [
            (axis, "angle", "phone", axis, "inertial", sign, "rad")
            for axis, sign in zip(turns[:2], signs, strict=False)
        ],
        "phone": [
            *(
                (f"{axis}_rate", "angular rate", "phone", axis, "body", sign, "rad/s")
                for axis, sign in zip(turns, signs, strict=True)
            ),
            *(
                (f"a{axis}", "acceleration", "phone", axis, "body", sign, "m/s^2")
                for axis, sign in zip("xyz", signs, strict=True)
            ),
        ],
    }
    keys = ("channel", "quantity", "at", "component", "frame", "sign", "unit")
    for name, (clock_times, columns) in tables.items():
        header = ",".join(("time [s]", *(f"{row[0]} [{row[-1]}]" for row in rows[name])))
        np.savetxt(
            scene_folder / f"{name}.csv",
            np.column_stack([clock_times, *columns]),
            "%.9g",
            ",",
            header=header,
            comments="",
        )
    files = [
        {"file": f"{name}.csv", "channels": [dict(zip(keys, row, strict=True)) for row in rows_of_file]}
        for name, rows_of_file in rows.items()
    ]
    return build(
        {
            "title": "moving car",
            "system": "measured",
            "vehicle": {"file": "r19_free"},
            "stabilise": {"method": "none"},
            "sensors": {"phone": {"body": "body", "position": [0.0, 0.0, 1.0]}},
            "files": files,
        },
        "scene.toml",
        scene_folder,
    )
