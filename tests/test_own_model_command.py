"""``twinrig twin`` as a user meets it: what it prints, its page, its codes and its errors."""

import re
import sys

import pytest

from studies import command_line
from validation.cases import twin_files
from validation.own_model.files import ARM_URDF, CART


@pytest.fixture
def asked(tmp_path, monkeypatch, capsys):
    """Function that runs the command in a folder with a cart and an arm: its code, output and errors."""
    monkeypatch.chdir(tmp_path)
    (tmp_path / "cart.xml").write_text(CART)
    (tmp_path / "arm.urdf").write_text(ARM_URDF)
    (tmp_path / "other.xml").write_text(CART.replace('damping=".1"', 'damping=".2"'))

    (tmp_path / "slow.xml").write_text(CART.replace("<worldbody>", '<option timestep="1e-7"/><worldbody>'))

    def ask(*words):
        monkeypatch.setattr(sys, "argv", ["twinrig", "twin", *words])
        with pytest.raises(SystemExit) as ended:
            command_line.main()
        said = capsys.readouterr()
        return ended.value.code, said.out, said.err

    return ask


def test_one_file_is_certified_and_gets_a_page(asked, tmp_path):
    code, said, _ = asked("cart.xml", "--states", "3", "--page", "cart.html")
    assert code == 0 and "every build moves as the file does" in said
    page = (tmp_path / "cart.html").read_text()
    assert "0.0e+00" not in page and "0.0e+00" not in said
    assert "Provenance" in page and "damping" in page and "sha256" in page
    assert not re.search(r"(?:src|href)=\"?(?:https?:)?//", page)  # nothing is fetched
    code, _, error = asked("cart.xml", "--page", "cart.html")
    assert code == 2 and "nothing is overwritten" in error


def test_two_files_that_differ_end_with_code_1_and_name_why(asked, tmp_path):
    code, said, _ = asked("cart.xml", "other.xml", "--states", "3", "--no-paths", "--page", "two.html")
    assert code == 1
    assert "damping of joint 'x': 0.1 N s/m in cart.xml, 0.2 N s/m in other.xml" in said
    assert "damping of joint &#39;x&#39;: 0.1 N s/m in cart.xml" in (tmp_path / "two.html").read_text()


def test_a_gear_without_influence_names_the_controls_at_which_it_has_none(asked, tmp_path):
    for name, gear in (("a.xml", 2), ("b.xml", 3)):
        motor = f'<actuator><motor name="push" joint="x" gear="{gear}"/></actuator></mujoco>'
        (tmp_path / name).write_text(CART.replace("</mujoco>", motor))
    code, said, _ = asked("a.xml", "b.xml", "--states", "2", "--no-paths")
    assert code == 0 and "without influence at controls of 0, or the nearest in range: gear of actuator 'push'" in said


def test_files_of_other_joints_are_told_apart(asked):
    code, said, _ = asked("cart.xml", "arm.urdf", "--states", "2", "--no-paths")
    assert code == 1 and "joint 'x' of cart.xml has no partner" in said


def test_the_price_names_a_setting_of_every_engine_and_what_its_default_loses(asked):
    code, said, _ = asked("cart.xml", "--states", "2", "--no-paths", "--tolerance", "1e-4", "--quantity", "tilt")
    assert code == 0 and "tilt within 0.0001 rad over 1 s" in said
    assert "MuJoCo's default, Euler, 2 ms" in said and "Exudyn's default, GeneralizedAlpha, 5 ms" in said
    assert re.search(r"in the engine\n +(exudyn\.DynamicSolverType|<option integrator)", said)


@pytest.mark.parametrize(
    "words,said",
    [
        (("nowhere.xml",), "nowhere.xml: cannot be read"),
        (("cart.xml", "--without", "contacts"), "did you mean 'contact'"),
        (("cart.xml", "--states", "0"), "--states = 0: must be 1 or more"),
        (("cart.xml", "arm.urdf", "other.xml"), "one, or two to be compared"),
        (("cart.xml", "--page", "no/page.html"), "no/page.html"),
        (("cart.xml", "--quantity", "tilt"), "give both, or neither"),
        (("cart.xml", "--controls", "c.csv"), "the model has no actuators"),
        (("cart.xml", "--controls", "c.csv", "--no-paths"), "leave out --no-paths"),
        (("cart.xml", "other.xml", "--controls", "c.csv"), "paths of one file alone"),
        (("slow.xml",), "would take 10,000,000 steps, of 100,000 at the most: leave them out with `--no-paths`"),
        (("cart.xml", "--tolerance", "-1", "--states", "1", "--no-paths"), "--tolerance = -1.0: must be a finite"),
        (("cart.xml", "--tolerance", "1", "--quantity", "tild", "--states", "1", "--no-paths"), "did you mean 'tilt'"),
    ],
)
def test_mistakes_are_one_message(asked, words, said):
    code, out, error = asked(*words)
    assert code == 2 and said in error and "Traceback" not in error and not out


def test_rows_of_the_quick_case_pass(tmp_path):
    rows, _ = twin_files.measure(True, tmp_path)
    assert [row.id for row in rows if row.status != "passed"] == []
    assert len(rows) == 12
