"""A train in the figures of merit, and from above."""

from types import SimpleNamespace

import numpy as np
import pytest

from models.brake.trailer import CHOSEN_TRAILER
from models.systems.braking.adhesion import measured_utilisation
from models.systems.braking.of_scene import plane_of
from models.systems.braking.scene import build
from models.systems.braking.stop_report import StopHistory
from studies.braking_figures import positions_on_road, unit_outlines

TABLE = {
    "title": "t",
    "system": "braking",
    "controller": {"kind": "slip_bang_bang"},
    "trailer": CHOSEN_TRAILER.model_dump(),
    "procedures": {"stop": {"speed": 10.0}},
}


@pytest.mark.grounds("closed form")
def test_hitch_angles_are_of_the_drawbar_against_the_truck():
    states = np.zeros((3, 2, 5))
    states[:, 0, 2:4] = [[0.0, 0.0], [0.1, -0.2], [0.3, 0.2]]
    stop = StopHistory(SimpleNamespace(states=states, times=np.array([0.0, 1.0, 2.0]), coordinates=()))
    assert stop.hitch_results() == pytest.approx(
        {
            "largest hitch angle [deg]": np.degrees(-0.3),
            "largest hitch angle at [s]": 1.0,
            "final hitch angle [deg]": np.degrees(-0.1),
        }
    )


@pytest.mark.grounds("closed form")
def test_the_train_is_drawn_where_its_hinges_are():
    scene = build(TABLE)
    (_, truck), (drawbar, line), (body, box) = unit_outlines(scene)
    positions = np.array([10.0, 5.0, 0.0, np.pi / 2.0, 0.0])  # the drawbar across
    plane = plane_of(scene)
    hook, hinge = positions_on_road(drawbar, line, positions, plane)
    assert hook == pytest.approx([10.0 + CHOSEN_TRAILER.hook, 5.0]) and hinge == pytest.approx(
        hook - [0.0, CHOSEN_TRAILER.drawbar]
    )
    ahead = positions_on_road(body, box, positions, plane)
    assert ahead[:2].mean(axis=0) - hinge == pytest.approx([1.2, 0.0])
    assert positions_on_road(0, truck, positions, plane).max(axis=0) == pytest.approx([10.0 + 1.42 + 1.2, 6.1])


@pytest.mark.full
def test_adhesion_of_every_axle_of_a_train_is_that_of_its_tyres():
    found = measured_utilisation(build(TABLE), "ice")
    k = np.array([found.adhesion.front, found.adhesion.rear, *found.adhesion.trailer])
    # friction peaks at 0.172; Annex 13 takes 0.010 or 0.015 of the truck's other axle off, which does not roll so here
    assert k.size == 4 and ((k > 0.14) & (k < 0.172)).all() and k[2:].min() > 0.155
    assert k.min() <= found.k_vehicle <= k.max() and 0.75 < found.epsilon < 1.05
