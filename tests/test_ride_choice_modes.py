"""What a linear choice reads off the motions of a vehicle, against solves; and what it says of its cost."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.linalg import expm, solve_continuous_lyapunov

from models.advice.ride_choice.modes import modes_of
from models.advice.ride_choice.reduced import FullScene
from models.advice.ride_choice.response import Response
from models.advice.ride_choice.screen import exact_variances, variances_from_modes
from models.ride.covariance import noise_intensity_of_system
from models.systems.ride.omissions import effects_of
from models.systems.ride.reduced_scene import ReducedScene, reduced_without
from models.systems.ride.scene import build

TABLE = {
    "title": "t",
    "system": "ride",
    "vehicle": {"file": "half_car"},
    "road": {"cutoff": 50.0},
    "speeds": {"values": [20.0]},
}


def whole(**more):
    return FullScene(ReducedScene.complete(build({**TABLE, **more}, "t")), 20.0)


@pytest.mark.parametrize("more", [{}, {"weighting": {"body front": "Wk"}}], ids=["plain", "weighted"])
def test_motions_tell_covariance_adjoint_and_exponential(more):
    reduced = whole(**more).full
    A, C, modes = reduced.system.A, reduced.system.C[:2], reduced.modes
    assert modes is not None and np.abs((modes.V * modes.rates) @ modes.W - A).max() < 1e-10 * np.abs(A).max()
    noise = noise_intensity_of_system(reduced.system)
    assert reduced.noise == pytest.approx(noise, rel=1e-9, abs=1e-12 * np.abs(noise).max())
    P, size = solve_continuous_lyapunov(A, -noise), np.sqrt
    scale = size(np.outer(P.diagonal(), P.diagonal()))
    assert np.abs((modes.covariance(noise) - P) / scale).max() < 1e-9
    L = np.array([solve_continuous_lyapunov(A.T, -np.outer(c, c)) for c in C])
    scale = size(np.einsum("ki,kj->kij", *[np.diagonal(L, axis1=1, axis2=2)] * 2))
    assert np.abs(modes.adjoints(C) - L).max() < 1e-9 * scale.max()
    assert modes.propagated(0.1, np.eye(len(A))) == pytest.approx(expm(0.1 * A), abs=1e-8 * np.abs(A).max())


def test_motions_that_are_alike_are_left_to_the_solve():
    assert modes_of(np.array([[-1.0, 1.0], [0.0, -1.0]])) is None


def test_responses_by_motions_are_those_of_the_solve_with_and_without_mass():
    scene = whole()
    effects = [effect for effect in effects_of(scene.scene) if effect.name in ("mass of all wheels", "tyre damping")]
    omega = np.geomspace(0.01, 1e5, 50)
    for rest in (scene.scene, reduced_without(scene.scene, effects)):
        vehicle = scene.reduced(rest).reduced_vehicle
        response = Response(vehicle, [0, 2], omega)
        assert response.motions is not None
        vehicle.__dict__["modes"] = None
        solved = Response(vehicle, [0, 2], omega)
        del vehicle.__dict__["modes"]
        for by_motions, by_solve in zip(
            (response.H, *response.coordinates()), (solved.H, *solved.coordinates()), strict=True
        ):
            assert np.abs(by_motions - by_solve).max() < 1e-9 * np.abs(by_solve).max()


def test_variances_by_motions_are_those_of_the_exact_solve_and_wrong_motions_are_seen():
    reduced = whole().full
    exact = exact_variances(reduced, [0, 2])
    assert variances_from_modes(reduced, [0, 2]) == pytest.approx(exact, rel=1e-10)
    wrong = replace(reduced)
    wrong.__dict__["modes"] = replace(reduced.modes, rates=reduced.modes.rates * (1 + 1e-6))
    wrong.__dict__["noise"] = reduced.noise
    assert variances_from_modes(wrong, [0, 2]) is None


def test_show_says_beforehand_what_a_choice_takes(twinrig, capsys):
    assert twinrig("show", "ride_choice") == 0
    assert "among 7 effects, 12 states and 1 speeds, about " in capsys.readouterr().out
