"""Pictures: poses of both engines, arrows as long as their forces say, films of the right length, plain refusals."""

from dataclasses import replace
from importlib import import_module
from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from models.core.errors import InputError
from models.rail.wheelset import CHOSEN_WHEELSET
from studies import animation
from studies.command.asked import load_scene
from studies.pictures import video
from studies.pictures.camera import Camera, painted_picture
from studies.pictures.drawing import arrow_lines, drawn_pose
from studies.pictures.film import largest_motion_differences
from studies.pictures.page import FilmPage
from studies.pictures.shapes import arrow, box

TIMES = np.array([0.0, 0.02, 0.05])


@pytest.fixture(scope="module")
def hunting():
    return import_module("studies.pictures.wheelset").stage_and_motions(0.05, TIMES, ("exudyn", "mujoco"))


@pytest.mark.parametrize("vehicle", ["wheelset", "pitch_plane", "r19_free"])
def test_both_engines_report_the_same_poses(vehicle, hunting):
    found = import_module(f"studies.pictures.{vehicle}")
    _, motions = hunting if vehicle == "wheelset" else found.stage_and_motions(0.05, TIMES, ("exudyn", "mujoco"))
    places, rotations, _ = largest_motion_differences(*motions)
    assert places < 1e-9 and rotations < 1e-9
    for motion in motions:  # they move, and a hundred times further than that: the slowest on a road that fades in
        assert max(np.ptp(place, axis=0).max() for place in motion.positions.values()) > 1e-7
        for turn in motion.rotations.values():
            np.testing.assert_allclose(turn @ turn.swapaxes(1, 2), np.broadcast_to(np.eye(3), turn.shape), atol=1e-12)


def test_a_difference_is_told(hunting):
    _, (one, two) = hunting
    moved = replace(two, positions={name: place + np.array([0.0, 1e-6, 0.0]) for name, place in two.positions.items()})
    assert largest_motion_differences(one, moved)[0] == pytest.approx(1e-6, rel=1e-6)


def test_arrows_are_as_long_as_their_forces(hunting):
    stage, (motion, _) = hunting
    for own, (tail, vector) in zip(motion.arrows, arrow_lines(motion, stage, 1), strict=True):
        np.testing.assert_allclose(vector, stage.arrow_styles[own.kind].scale * own.vectors[1], rtol=1e-15)
        drawn = arrow(tail, vector, 0.02, (1.0, 0.0, 0.0))
        along = (drawn.corners - tail) @ vector / np.linalg.norm(vector)
        assert along.min() == pytest.approx(0.0, abs=1e-12) and along.max() == pytest.approx(np.linalg.norm(vector))


def test_contact_forces_carry_the_wheelset_where_its_wheels_touch(hunting):
    _, (motion, _) = hunting
    total = sum(own.vectors[0] for own in motion.arrows)
    assert total[2] == pytest.approx(
        -CHOSEN_WHEELSET.load, rel=1e-3
    )  # it starts in vertical balance; the springs share by um
    for own in motion.arrows:
        side = 1.0 if own.name.endswith("right") else -1.0
        # Within the rail's head of 36 mm to both sides, at the height of its top; z is down.
        assert abs(own.points[0, 1] - side * CHOSEN_WHEELSET.half_gauge) < 0.036
        assert own.points[0, 2] == pytest.approx(CHOSEN_WHEELSET.radius, abs=2e-3)


def test_what_is_magnified_leans_more_and_spins_as_it_does(hunting):
    stage, (motion, _) = hunting
    lean, spin = Rotation.from_euler("x", 0.01), Rotation.from_euler("y", 2.0)
    turned = replace(
        motion,
        rotations={"wheelset": np.array([(lean * spin).as_matrix()])},
        positions={"wheelset": np.array([[0.0, 2e-3, 0.0]])},
    )
    place, turn = drawn_pose(turned, replace(stage, magnification=5.0), "wheelset", 0)
    np.testing.assert_allclose(place, [0.0, 1e-2, 0.0], atol=1e-15)
    np.testing.assert_allclose(turn, (Rotation.from_euler("x", 0.05) * spin).as_matrix(), atol=1e-12)


def test_the_nearer_of_two_boxes_hides_the_other_one_and_lengths_are_those_of_the_legend():
    camera = Camera((10.0, 0.0, 0.0), (0.0, 0.0, 0.0))
    red, blue = box(1.0, 2.0, 1.0, (1.0, 0.0, 0.0)), box(1.0, 1.0, 1.0, (0.0, 0.0, 1.0))
    for order in ([red, blue.at(3.0, 0.0, 0.0)], [blue.at(3.0, 0.0, 0.0), red]):
        image = painted_picture(camera, [order], 80, 60, np.ones((2, 3)))
        assert image[30, 40, 2] > 0.2 > image[30, 40, 0]
    (left, right), _ = camera.projected_points(np.array([[0.0, -0.5, 0.0], [0.0, 0.5, 0.0]]), 80, 60)
    assert right[0] - left[0] == pytest.approx(camera.pixels_per_metre(60)) and right[1] == left[1] == 30.0


def test_a_film_has_as_many_frames_as_its_duration_and_rate_say(hunting, tmp_path):
    scene = changed("film.duration=0.05", "film.slow_motion=4", "film.frames_per_second=30")
    assert scene.film.frame_count == len(scene.film.frame_times()) == 6  # 0.05 s x 4 x 30
    np.testing.assert_allclose(np.diff(scene.film.frame_times()), 1.0 / 120.0)
    if video.missing_extra("mp4"):
        pytest.skip(video.missing_extra("mp4"))
    import imageio_ffmpeg

    frames = list(FilmPage(*hunting).frames())
    assert frames[0].shape == (720, 1280, 3) and (frames[0] != frames[2]).any()
    for kind in hunting[
        0
    ].arrow_styles.values():  # the legend's arrow below the pictures, as long as its force is drawn
        shaft = np.isclose(frames[0][480:492], 255.0 * np.array(kind.colour), atol=1.0).all(axis=2).any(axis=0)
        long = kind.scale * kind.legend * hunting[0].camera.pixels_per_metre(400)
        assert np.ptp(np.flatnonzero(shaft)) == pytest.approx(long, abs=5.0)  # its tip is blurred
    path = video.write(tmp_path / "film.mp4", frames * 2, 30)
    assert imageio_ffmpeg.count_frames_and_secs(str(path))[0] == 6
    assert video.write(tmp_path / "film.gif", [frame[::8, ::8] for frame in frames], 25).stat().st_size > 1000


def changed(*changes):
    return load_scene("animation", list(changes))


def test_without_the_extra_the_stills_are_kept_and_one_sentence_names_it(hunting, monkeypatch, tmp_path):
    monkeypatch.setattr(video, "VIDEO_PACKAGES", ("no_such_package",))
    own = import_module("studies.pictures.wheelset")
    monkeypatch.setattr(own, "stage_and_motions", lambda *given: hunting)
    summary = animation.run(changed("film.duration=0.05"), ("exudyn", "mujoco"), tmp_path, lambda text, part: None)
    assert {path.name for path in tmp_path.iterdir()} == {"page.png", "exudyn.png", "mujoco.png"}
    assert "twinrig[video]" in summary["table"][-1] and "twinrig[video]" not in "".join(summary["table"][:-1])


@pytest.mark.parametrize(
    ("change", "place", "said"),
    [
        ("vehicle=tram", "vehicle", "wheelset"),
        ("film.frames_per_second=-5", "film.frames_per_second", "1"),
        ("film.duration=-1", "film.duration", "0"),
        ("film.duration=100", "film.duration", "10000 frames"),  # 100 s x 4 x 25
        ("film.duration=1000", "film.duration", "120"),
        ("film.format=avi", "film.format", "gif"),
    ],
)
def test_bad_input_is_refused_with_its_place(change, place, said):
    with pytest.raises(InputError) as found:
        changed(change)
    assert found.value.place == place and said in str(found.value)


def test_the_scene_is_described():
    from studies.pictures.plan import describe

    assert "wheelset" in describe(changed()) and Path(changed().file).name.startswith("animation")
