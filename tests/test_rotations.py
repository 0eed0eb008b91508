"""Quaternions: the paper's conventions, the order of each rule, a norm that stays, gimbal lock that is named."""

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.spatial.transform import Rotation

from models.sensors import rotations as r

RANDOM = np.random.default_rng(5)
SOME = r.quaternion_of_rotation_vector(RANDOM.normal(size=(200, 3)) * 1.5)


def rate(t):
    """A rate (rad/s) whose axis turns, so that a rule without the second Magnus term shows."""
    return np.stack([np.sin(2 * t), 0.7 * np.cos(3 * t), 0.5 + 0.4 * np.sin(t)], axis=-1)


def tight(end):
    def slope(t, q):
        return 0.5 * r.quaternion_product(q, np.concatenate(([0.0], rate(t))))

    return solve_ivp(slope, (0, end), [1.0, 0, 0, 0], "DOP853", rtol=1e-13, atol=1e-14).y[:, -1]


@pytest.mark.grounds("written equations")
def test_matrix_is_the_papers_equation_21():
    for q in SOME[:20]:
        a, b, c, d = q
        wanted = [
            [a * a + b * b - c * c - d * d, 2 * (b * c - a * d), 2 * (b * d + a * c)],
            [2 * (b * c + a * d), a * a - b * b + c * c - d * d, 2 * (c * d - a * b)],
            [2 * (b * d - a * c), 2 * (c * d + a * b), a * a - b * b - c * c + d * d],
        ]
        assert np.abs(r.rotation_matrix(q) - wanted).max() < 1e-15


@pytest.mark.grounds("plain counterpart")
def test_matrix_agrees_with_scipy_and_comes_back():
    assert np.abs(r.rotation_matrix(SOME) - Rotation.from_quat(SOME, scalar_first=True).as_matrix()).max() < 2e-15
    back = r.quaternion_from_matrix(r.rotation_matrix(SOME))
    assert np.abs(back * np.sign(SOME[:, :1]) - SOME).max() < 2e-15


@pytest.mark.grounds("closed form")
def test_product_logarithm_and_conjugate():
    p, q = SOME[:100], SOME[100:]
    assert (
        np.abs(r.rotation_matrix(r.quaternion_product(p, q)) - r.rotation_matrix(p) @ r.rotation_matrix(q)).max()
        < 3e-15
    )
    assert np.abs(r.quaternion_product(q, r.conjugate_quaternion(q)) - [1, 0, 0, 0]).max() < 1e-15
    for size in (1e-12, 1e-3, 1.0, 3.1):  # a tiny rotation keeps all its digits
        turn = size * np.array([0.6, -0.48, 0.64])
        assert (
            np.abs(r.rotation_vector(-r.quaternion_of_rotation_vector(turn)) - turn).max()
            < 4e-16 * max(size, 1e-12) * 10
        )


@pytest.mark.grounds("closed form")
def test_skew_is_the_vector_product():
    v, x = RANDOM.normal(size=(2, 7, 3))
    assert np.allclose(np.einsum("nij,nj->ni", r.skew_matrix(v), x), np.cross(v, x), rtol=0, atol=1e-15)


@pytest.mark.parametrize(("rule", "order"), [("held", 1), ("mean", 2), ("cubic", 4)])
def test_order_of_each_rule(rule, order):
    truth, errors = tight(2.0), []
    for count in (200, 400):
        found = r.integrate_attitude(rate(np.linspace(0, 2, count + 1)), 2 / count, np.array([1.0, 0, 0, 0]), rule)[-1]
        errors.append(np.linalg.norm(r.rotation_vector(r.quaternion_product(r.conjugate_quaternion(truth), found))))
    # the ratio approaches 2**order as the period falls; a lost Magnus term would leave "cubic" at order 2
    assert np.log2(errors[0] / errors[1]) == pytest.approx(order, abs=0.15)


def test_norm_stays_one_over_a_million_steps():
    rates = RANDOM.normal(size=(1_000_001, 3)) * 5
    norms = np.linalg.norm(r.integrate_attitude(rates, 1e-3, np.array([1.0, 0, 0, 0]), "held"), axis=1)
    # three roundings of 1.1e-16 each; without the division the norm walks to 4e-14
    assert np.abs(norms - 1).max() < 5e-16


def test_several_bodies_at_once_are_the_same_as_one():
    rates = RANDOM.normal(size=(50, 3, 3))
    start = r.quaternion_of_rotation_vector(RANDOM.normal(size=(3, 3)))
    together = r.integrate_attitude(rates, 0.01, start)
    alone = [r.integrate_attitude(rates[:, j], 0.01, start[j]) for j in range(3)]
    assert np.array_equal(together, np.stack(alone, axis=1))


@pytest.mark.grounds("plain counterpart")
def test_cardan_angles_go_there_and_back():
    angles = RANDOM.uniform([-3.1, -1.5, -3.1], [3.1, 1.5, 3.1], (500, 3))
    assert np.abs(r.cardan_angles(r.quaternion_from_cardan(*angles.T)) - angles).max() < 1e-13  # cos(pitch) > 0.07
    scipy_angles = Rotation.from_quat(SOME, scalar_first=True).as_euler("ZYX")[:, ::-1]
    assert np.abs(r.cardan_angles(SOME) - scipy_angles).max() < 1e-12


def test_pitch_is_positive_nose_up():
    nose = r.rotation_matrix(r.quaternion_from_cardan(0.0, 0.1, 0.0)) @ [1.0, 0, 0]
    assert nose[2] == pytest.approx(-np.sin(0.1))  # z is down


@pytest.mark.parametrize("sign", [1, -1])
def test_gimbal_lock_is_named_and_not_a_number(sign):
    path = r.quaternion_from_cardan(np.zeros(5), sign * np.linspace(0, np.pi / 2, 5), np.zeros(5))
    with pytest.raises(r.GimbalLock, match="sample 4: gimbal lock") as caught:
        r.cardan_angles(path)
    assert caught.value.sample == 4 and caught.value.pitch == pytest.approx(sign * np.pi / 2)
    assert np.isfinite(r.cardan_angles(path[:4])).all()


def test_what_is_no_rotation_or_no_number_is_refused():
    with pytest.raises(ValueError, match="not a rotation"):
        r.quaternion_from_matrix(np.diag([1.0, 1.0, -1.0]))
    with pytest.raises(ValueError, match="not a rotation"):
        r.quaternion_from_matrix(1.01 * np.eye(3))
    rates = np.zeros((6, 3))
    with pytest.raises(ValueError, match="at least 4"):
        r.integrate_attitude(rates[:3], 0.1, np.array([1.0, 0, 0, 0]))
    rates[3, 1] = np.nan
    with pytest.raises(ValueError, match="sample 3"):
        r.integrate_attitude(rates, 0.1, np.array([1.0, 0, 0, 0]))
