"""Small bodies with routes, as MJCF and URDF."""

from __future__ import annotations

from pathlib import Path

import pytest

HEAD = '<mujoco model="made"><compiler angle="degree" autolimits="true"/>'


def require_mujoco():
    """The module mujoco; the test is skipped without it."""
    return pytest.importorskip("mujoco", reason="needs the package mujoco")


def arm(
    *,
    limits: str = "-25 20",
    front: str = "0.05 0 0.3",
    insertion: str = "0.04 0 -0.1",
    names: tuple[str, str] = ("arm_flexor", "arm_extensor"),
    further: str = "",
    geoms: str = "",
    after: str = "",
) -> str:
    """A rod of 1 kg and 0.4 m that hangs from a hinge about y, with a route on each side.

    front      origin of the first route on the stand
    insertion  its point on the rod
    further    further elements inside the rod
    geoms      further elements on the stand
    """
    back = " ".join([str(-float(front.split(maxsplit=1)[0])), *front.split()[1:]])
    back_insertion = " ".join([str(-float(insertion.split(maxsplit=1)[0])), *insertion.split()[1:]])
    stated = f'range="{limits}"' if limits else ""
    return f"""{HEAD}
  <worldbody>
    <body name="stand" pos="0 0 1">
      {geoms}
      <site name="front" pos="{front}"/>
      <site name="back" pos="{back}"/>
      <body name="rod">
        <inertial pos="0 0 -0.2" mass="1" diaginertia="0.0133333 0.0133333 0.0001"/>
        <joint name="arm" axis="0 1 0" {stated}/>
        <site name="front_insertion" pos="{insertion}"/>
        <site name="back_insertion" pos="{back_insertion}"/>
        {further}
      </body>
    </body>
  </worldbody>
  <tendon>
    <spatial name="{names[0]}"><site site="front"/><site site="front_insertion"/></spatial>
    <spatial name="{names[1]}"><site site="back"/><site site="back_insertion"/></spatial>
  </tendon>
  {after}
</mujoco>
"""


def chain(count: int, length: float = 0.1, limits: str = "-20 40") -> str:
    """Links along x with hinges about z, and a route from the base to the tip."""
    opening = "".join(
        f'<body pos="{length if number else 0} 0 0"><joint name="j{number}" axis="0 0 1"'
        f' range="{limits}"/><geom size="0.01" mass="0.1"/>'
        for number in range(count)
    )
    return f"""{HEAD}
  <worldbody><site name="base"/>{opening}<site name="tip" pos="{length} 0 0"/>
  {"</body>" * count}</worldbody>
  <tendon><spatial name="route"><site site="base"/><site site="tip"/></spatial></tendon>
</mujoco>
"""


def legs(right: tuple[str, str] = ("hip_R_flexor", "hip_R_extensor")) -> str:
    """Two mirrored legs with hips about y; the names of the right routes, front and back."""
    sides = "".join(
        f"""<body name="thigh_{side}" pos="0 {y} 0"><joint name="hip_{side}" axis="0 1 0"
          range="-20 20"/><geom type="capsule" size="0.01" fromto="0 0 -0.02 0 0 -0.3" mass="1"/>
          <site name="thigh_front_{side}" pos="0.04 0 -0.1"/>
          <site name="thigh_back_{side}" pos="-0.04 0 -0.1"/></body>
        <site name="front_{side}" pos="0.05 {y} 0.3"/><site name="back_{side}" pos="-0.05 {y} 0.3"/>"""
        for side, y in (("L", 0.1), ("R", -0.1))
    )
    routes = "".join(
        f'<spatial name="{name}"><site site="{place}_{side}"/><site site="thigh_{place}_{side}"/>'
        "</spatial>"
        for side, names in (("L", ("hip_L_flexor", "hip_L_extensor")), ("R", right))
        for place, name in zip(("front", "back"), names, strict=True)
    )
    return f"""{HEAD}<worldbody><body name="pelvis" pos="0 0 1">{sides}</body></worldbody>
  <tendon>{routes}</tendon></mujoco>"""


URDF = """<robot name="made">
  <link name="base"/>
  <link name="rod"><inertial><origin xyz="0 0 -0.2"/><mass value="1"/>
    <inertia ixx="0.01" iyy="0.01" izz="0.001" ixy="0" ixz="0" iyz="0"/></inertial></link>
  <joint name="arm" type="revolute"><parent link="base"/><child link="rod"/><axis xyz="0 1 0"/>
    <limit lower="-0.5" upper="1.0" effort="1" velocity="1"/></joint>
</robot>
"""
URDF_ROUTES = """[[route]]
name = "arm_flexor"
points = [
    { body = "base", at = ["50 mm", "0 mm", "300 mm"] },
    { body = "rod", at = ["40 mm", "0 mm", "-100 mm"] },
]
"""


def written(folder: Path, text: str, name: str = "body.xml") -> Path:
    """The path of a text in a folder."""
    path = folder / name
    path.write_text(text, encoding="utf-8")
    return path
