"""Claims about animations: what is drawn is the geometry at the recorded contraction, frames follow
the time, files have the wanted format, and what cannot be drawn is refused."""

from __future__ import annotations

import dataclasses
import itertools

import numpy as np
import pytest
from control_plants import JOINT, LIFT

import airmuscle as am
from airmuscle.errors import ColumnError, FileError, ParameterError
from airmuscle.files import library
from airmuscle.physics import Braid, MuscleRoute, SerialArm, SpatialLink
from airmuscle.physics.plant.drawing import muscle_outline

ROUTES = (MuscleRoute((1,), (0.02,), 0.1), MuscleRoute((1,), (-0.02,), 0.1))
FILL = am.Schedule({"fill": ((0.0, 0.3),)})


@pytest.fixture(scope="module")
def lift():
    return am.simulate(
        LIFT, FILL, duration=0.1, initial_state=LIFT.state_at(pressure=1e5, position=0.01)
    )


@pytest.fixture(scope="module")
def joint():
    return am.simulate(
        JOINT,
        am.Schedule({"left.fill": ((0.0, 0.5),)}),
        duration=0.2,
        initial_state=JOINT.state_at(pressure=2e5),
    )


def test_the_outline_of_a_muscle_is_that_of_its_geometry_and_bulges_with_contraction():
    braid = Braid(radius=0.01, braid_angle=0.42, resting_length=0.3)
    for contraction in (0.0, 0.2):
        outline = muscle_outline(braid, contraction)
        assert np.ptp(outline[:, 1]) == pytest.approx(0.3 * (1 - contraction))
        assert outline[:, 0].max() == pytest.approx(braid.radius_at(contraction))
        np.testing.assert_allclose(
            outline[: len(outline) // 2], outline[: len(outline) // 2 - 1 : -1] * (-1.0, 1.0)
        )
    straight = library.load("saga2007-circle").muscle.geometry
    outline = muscle_outline(straight, 0.1)
    np.testing.assert_allclose(outline[:121, 0], straight.outline(0.1, 121)[1])


def test_the_pointer_has_the_angle_and_the_muscles_their_lengths(joint):
    animation = joint.animate(JOINT)
    scene = animation._scene
    row = {name: float(joint[name][-1]) for name in joint}
    drawing = scene.draw(row)
    tip = drawing.lines[-1][1]
    assert np.arctan2(-tip[0], tip[1]) == pytest.approx(row["angle"])
    muscles = [shape for shape in drawing.shapes if shape.pressure is not None]
    for shape, name in zip(muscles, ("left", "right"), strict=True):
        assert shape.pressure == row[f"{name}.pressure"]
        length = JOINT.muscles[0].geometry.resting_length * (1 - row[f"{name}.contraction"])
        assert np.ptp(shape.points[:, 1]) == pytest.approx(length)
    assert muscles[0].points[:, 0].max() < muscles[1].points[:, 0].min()


def test_the_end_of_a_planar_arm_is_drawn_where_its_tip_is():
    arm = library.load("arm-lilly-quesada").plant
    run = am.simulate(arm, am.Schedule({}), duration=0.05, initial_state=arm.state_at(pressure=3e5))
    drawing = run.animate(arm)._scene.draw({name: float(run[name][-1]) for name in run})
    (links,) = drawing.lines
    state = {c.name: float(run[c.name][-1]) for c in arm.mechanism.coordinates}
    assert links[-1] == pytest.approx(arm.mechanism.tip(state), abs=1e-12)
    muscles = [shape.points for shape in drawing.shapes if shape.pressure is not None]
    assert len(muscles) == 4
    for one, other in itertools.pairwise(muscles):
        assert one[:, 0].max() < other[:, 0].min()


def test_frames_follow_the_time_at_the_wanted_speed(joint):
    np.testing.assert_allclose(joint.animate(JOINT).times, np.arange(6) / 25, atol=1e-12)
    assert joint.animate(JOINT, speed=0.1).times.size == 51
    animation = joint.animate(JOINT)
    figure = animation.still(0.09)
    assert "0.08 s" in [text.get_text() for axes in figure.axes for text in axes.texts]


def test_a_load_is_drawn_and_written(lift, tmp_path):
    animation = lift.animate(LIFT, speed=2.0)
    assert animation.times.size == 2
    gif = animation.save(tmp_path / "lift.gif")
    page = animation.save(tmp_path / "lift.html")
    assert gif.read_bytes()[:6] == b"GIF89a"
    assert "<input" in page.read_text(encoding="utf-8")
    assert sorted(p.name for p in tmp_path.iterdir()) == ["lift.gif", "lift.html"]


def test_what_cannot_be_drawn_is_refused(lift, joint, tmp_path):
    arm = dataclasses.replace(
        JOINT, mechanism=SerialArm((SpatialLink((0, 0, 1), rotor_inertia=0.02),), ROUTES)
    )
    with pytest.raises(
        ParameterError, match="SerialArm with 2 muscles cannot be drawn; possible are"
    ):
        lift.animate(arm)
    with pytest.raises(ParameterError, match="is no plant"):
        lift.animate("lift")
    with pytest.raises(ColumnError, match=r"no column 'left\.pressure'"):
        lift.animate(JOINT)
    for count in (0, 1):
        with pytest.raises(ColumnError, match=f"two rows or more; there are {count}"):
            lift.rows(slice(count)).animate(LIFT)
    for speed, message in (
        (0.0, "must be positive"),
        (float("nan"), "must be finite"),
        (1e-5, "at most 3000"),
    ):
        with pytest.raises(ParameterError, match=message):
            lift.animate(LIFT, speed=speed)
    animation = lift.animate(LIFT)
    with pytest.raises(FileError, match=r"written as \.gif, \.mp4, \.html"):
        animation.save(tmp_path / "lift.avi")
    with pytest.raises(FileError, match="cannot be written"):
        animation.save(tmp_path / "missing" / "lift.gif")
    with pytest.raises(ParameterError, match="there is no frame 99"):
        animation.draw(99)
    assert list(tmp_path.iterdir()) == []
