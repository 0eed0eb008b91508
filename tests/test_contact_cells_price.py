"""The price of cells in rolling contact: recommended for a table or for one contact, held, refused."""

import numpy as np
import pytest

from models.advice.price.recommendation import priced_scene, recommend
from models.advice.price.text import recommendation_lines
from models.contact.fastsim import RollingEllipse, fastsim
from models.contact.material import MaterialPair
from models.core.errors import InputError
from models.systems.contact.scene import build

ROWS = [(5e-3, 3e-3, 8e4, 0.3, 1e-3 * k, 4e-4 * (k % 3), 0.1 * k) for k in range(12)]
WRONG = "5e-3,-3e-3,8e4,0.3,1e-3,0,0\n"


@pytest.fixture
def table(tmp_path):
    rows = "".join(",".join(map(str, row)) + "\n" for row in ROWS)
    (tmp_path / "cases.csv").write_text(
        "a [m],b [m],load [N],friction [-],xi_x [-],xi_y [-],spin [1/m]\n" + rows + WRONG
    )
    return build({"title": "a table", "system": "contact", "cases": {"file": "cases.csv"}}, "t.toml", tmp_path)


def forces(cells, march="second-order"):
    rolled = fastsim(RollingEllipse(*np.array(ROWS).T), MaterialPair(), cells=cells, march=march)
    return np.column_stack([rolled.fx, rolled.fy])


def test_the_fewest_cells_that_hold_a_table_to_its_tolerance(table):
    recommended = recommend(priced_scene(table, None, ()), 20.0)
    best, exact = recommended.winners["", "calls"], forces(400)
    cells = round(1.0 / best.tried.setting.value)
    assert np.abs(forces(cells, best.tried.setting.method) - exact).max() < 20.0 * 1.05 and best.calls == 12 * cells**2
    coarser = [each for each in recommended.tried if each.setting.curve == best.tried.setting.curve]
    fewer = [round(1.0 / each.setting.value) for each in coarser if each.setting.value > best.tried.setting.value]
    assert fewer and all(np.abs(forces(n, best.tried.setting.method) - exact).max() > 0.95 * 20.0 for n in fewer)
    text = "\n".join(recommendation_lines(recommended))
    assert "in the first 12 sound rows" in text and f"cells = {cells}" in text and "half the cells change it by" in text


def test_a_single_contact_and_its_moment():
    contact = {"title": "one", "system": "contact", "ellipse": {"a": 5e-3, "b": 3e-3}, "creepage": {"spin": 0.5}}
    scene = build({**contact, "contact": {"load": 8e4, "friction": 0.3}}, "t.toml")
    recommended = recommend(priced_scene(scene, "mz", ()), 0.05)
    assert recommended.scene.unit == "N m" and recommended.winners["", "calls"].error <= 0.05
    for quantity, place in (("f1", "is nothing that cells change"), ("fx,mz", "of two units")):
        with pytest.raises(InputError, match=place):
            priced_scene(scene, quantity, ())
    linear = build({**contact, "contact": {"load": 8e4, "friction": 0.3}, "method": {"name": "linear"}}, "t.toml")
    with pytest.raises(InputError, match=r"method.name.*has no cells that could be chosen"):
        priced_scene(linear, None, ())
