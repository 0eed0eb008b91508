"""A spatial vehicle in MuJoCo: native bodies and joints; forces through one compiled callback."""

from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

import mujoco
import numpy as np

from models.core.trajectory import Trajectory
from models.engines.assembly import Settings
from models.engines.mujoco import INTEGRATORS
from models.engines.mujoco_layout import check_offsets
from models.engines.mujoco_march import FORCE_CALLS, march
from models.engines.mujoco_quiet import installed_callback
from models.engines.mujoco_tree import MujocoIndices, mujoco_specification, set_masses
from models.engines.protocol import settings_of
from models.engines.spatial_mujoco_callback import HEADER, PER_TIME, ROAD, force_elements, packed_numbers, spatial_law
from models.engines.spatial_protocol import (
    EngineKinematics,
    checked_trajectory,
    curve_count,
    difference_step,
    jacobian,
    linear_vehicle,
)
from models.vehicles.linear_vehicle import LinearVehicle
from models.vehicles.spatial import SpatialVehicle, Vector


def _compiled_model(
    vehicle: SpatialVehicle,
    time_step: float,
    integrator: str,
    speed: float | None,
    road_rows: np.ndarray,
    rows_per_second: float,
) -> mujoco.MjModel:
    """The compiled MuJoCo model; its numeric data hold all numbers that the callback reads."""
    spec = mujoco_specification(vehicle, time_step)
    spec.option.integrator = INTEGRATORS[integrator]
    plain = spec.compile()
    counts, content = packed_numbers(vehicle, force_elements(vehicle, speed), plain, MujocoIndices(vehicle, plain))
    begins = HEADER + len(content)
    header = [rows_per_second, len(road_rows), len(vehicle.tyres), *counts, begins]
    spec.add_numeric(name="vehicle", size=begins + road_rows.size, data=[0.0])
    model = spec.compile()
    model.numeric_data[:] = np.concatenate([header, content, road_rows.ravel()])
    set_masses(model, MujocoIndices(vehicle, model), vehicle.bodies)
    return model


class SpatialMujoco:
    """One spatial vehicle in one MuJoCo model."""

    def __init__(
        self, vehicle: SpatialVehicle, run_settings: Settings | None, speed: float | None, road_rows: np.ndarray | None
    ) -> None:
        self.vehicle, self.settings = vehicle, run_settings
        self._flat = np.zeros(2 * len(vehicle.tyres))
        step, integrator = (run_settings.step, run_settings.integrator) if run_settings else (1e-3, "RK4")
        table = self._flat[None, :] if road_rows is None else road_rows
        self.model = _compiled_model(vehicle, step, integrator, speed, table, 0.0 if road_rows is None else 2.0 / step)
        self.data = mujoco.MjData(self.model)
        self.numbers = MujocoIndices(vehicle, self.model)
        self.law: Any = spatial_law()
        check_offsets(self.model, self.data)

    @contextmanager
    def _hold_road(self) -> Iterator[np.ndarray]:
        """Context in which the callback reads one row (2 w,) of the road at all times; this row is yielded and can be
        changed."""
        numbers = self.model.numeric_data
        first = int(numbers[ROAD])
        row = numbers[first : first + len(self._flat)]
        before = numbers[PER_TIME], row.copy()
        numbers[PER_TIME] = 0.0
        try:
            with installed_callback(self.law):
                yield row
        finally:
            numbers[PER_TIME], row[:] = before

    def acceleration(self, time: float, q: np.ndarray, v: np.ndarray, road_row: np.ndarray | None = None) -> np.ndarray:
        """Accelerations (n,) at a time (s), positions and rates (n,); ``road_row`` (2 w,) replaces the road's row at
        this time: heights (m), then rates (m/s) under w tyres."""
        if road_row is None:
            with installed_callback(self.law):
                return self._acceleration(q, v, time)
        with self._hold_road() as row:
            row[:] = road_row
            return self._acceleration(q, v)

    def _acceleration(self, q: np.ndarray, v: np.ndarray, time: float = 0.0) -> np.ndarray:
        """Accelerations (n,) at positions and rates (n,) and a time (s), with the callback that is installed."""
        columns = self.numbers.columns
        self.data.time, self.data.qpos[columns], self.data.qvel[columns] = time, q, v
        mujoco.mj_forward(self.model, self.data)
        return self.data.qacc[columns]

    def linearise(self) -> LinearVehicle:
        """The linear vehicle. The mass matrix comes from MuJoCo; damping, stiffness and the road's columns come from
        central differences of the accelerations, callback included."""
        n, zero, h = self.model.nv, np.zeros(self.model.nv), difference_step(self.vehicle)
        with self._hold_road() as row:

            def on_road(heights_and_rates: np.ndarray) -> np.ndarray:
                row[:] = heights_and_rates
                return self._acceleration(zero, zero)

            row[:] = 0.0
            stiffness = jacobian(lambda q: self._acceleration(q, zero), n, h)
            damping = jacobian(lambda v: self._acceleration(zero, v), n, h)
            road = jacobian(on_road, len(row), h)
            on_road(self._flat)
        mass = np.empty((n, n))
        mujoco.mj_fullM(self.model, self.data, mass)
        mass = mass[np.ix_(self.numbers.columns, self.numbers.columns)]
        motion = EngineKinematics(self.vehicle, self._point_jacobian, self._rotation_jacobian)
        return linear_vehicle("mujoco", self.vehicle, motion, mass, -mass @ damping, -mass @ stiffness, mass @ road)

    def _point_jacobian(self, body: str, point: Vector) -> np.ndarray:
        """Jacobian (3, n) of a point's displacement in the design position."""
        return self._jacobians(body, np.array(point, float))[0]

    def _rotation_jacobian(self, body: str) -> np.ndarray:
        """Jacobian (3, n) of a body's rotation in the design position."""
        return self._jacobians(body, np.zeros(3))[1]

    def _jacobians(self, body: str, point: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Jacobians (3, n) of a point's displacement and of its body's rotation, in the design position."""
        shift, turn = np.empty((2, 3, self.model.nv))
        self.data.qpos[:] = 0.0
        mujoco.mj_kinematics(self.model, self.data)
        mujoco.mj_comPos(self.model, self.data)
        mujoco.mj_jac(self.model, self.data, shift, turn, point, self.numbers.bodies[body])
        return shift[:, self.numbers.columns], turn[:, self.numbers.columns]

    def run(self, q: np.ndarray | None = None, v: np.ndarray | None = None) -> Trajectory:
        """Trajectory over the duration from positions and rates (n,), or from rest; raises RunFailed unless it is
        finite and sane."""
        settings, rest = settings_of("mujoco", self.settings), np.zeros(self.model.nv)
        both, start = np.concatenate((self.numbers.columns, rest.size + self.numbers.columns)), np.empty(2 * rest.size)
        start[both] = np.concatenate((rest if q is None else q, rest if v is None else v))
        with installed_callback(self.law):
            path = march(self.model, self.data, start, np.empty((settings.steps, 0)))
        times = settings.step * np.arange(settings.steps + 1)
        counts = {"steps": settings.steps, "force calls": FORCE_CALLS.get(settings.integrator, 1) * settings.steps}
        states = path if (np.diff(both) == 1).all() else path[:, both]
        return checked_trajectory("mujoco", settings, times, states, "", counts)

    def plan(self) -> dict[str, int]:
        """Counts of built items: degrees of freedom, native items, callbacks, and the curves among these."""
        return {
            "degrees of freedom": self.model.nv,
            "native items": self.model.nbody - 1 + self.model.njnt,
            "callbacks": 1,
            "curves": curve_count(self.vehicle),
        }
