"""Cars in MJCF: struts, uprights that steer and wheels that spin in front, trailing arms behind, an engine."""

CORNERS = {"fl": (1.2, 0.75), "fr": (1.2, -0.75), "rl": (-1.4, 0.74), "rr": (-1.4, -0.74)}
"""Position (m) of each wheel's centre: x forward and y to the left, from the middle of the car."""
RADIUS = 0.31
"""Height of the wheels' centres above the road, m."""


def _front_strut_text(corner_name: str, side_sign: int) -> str:
    """MJCF text of a front strut with a steered upright and a spinning wheel; ``side_sign`` is 1 left and -1 right."""
    x, y = CORNERS[corner_name]
    return f"""
  <body name="{corner_name} strut" pos="{x} {y} {RADIUS - 0.55}">
   <joint name="{corner_name} travel" type="slide" axis="0 0 1" stiffness="24000" damping="1700" range="-.09 .1"/>
   <inertial pos="0 {-0.1 * side_sign} .03" mass="14" diaginertia=".2 .3 .25"/>
   <body name="{corner_name} upright"><joint name="{corner_name} steer" axis="0 0 1" damping="5" armature=".1"/>
    <inertial pos="0 {-0.05 * side_sign} 0" mass="5" diaginertia=".05 .04 .05"/>
    <body name="{corner_name} wheel"><joint name="{corner_name} spin" axis="0 1 0"/>
     <inertial pos="0 {0.02 * side_sign} 0" mass="17" diaginertia=".6 1.1 .6"/>
     <geom name="{corner_name} rim" type="cylinder" size="{RADIUS} .1" euler="90 0 0" mass="0"/>
     <site name="tyre {corner_name}" user="190000 150 62000"/></body></body></body>"""


def _rear_arm_text(corner_name: str, side_sign: int) -> str:
    """MJCF text of a rear trailing arm with a sprung hinge and a spinning wheel; ``side_sign`` is 1 left and -1
    right."""
    x, y = CORNERS[corner_name]
    return f"""
  <body name="{corner_name} arm" pos="{x + 0.4} {y - 0.1 * side_sign} {RADIUS + 0.02 - 0.55}">
   <joint name="{corner_name} swing" axis="0 -1 0" stiffness="3900" damping="260" armature=".4" range="-.3 .3"/>
   <inertial pos="-.2 {0.03 * side_sign} 0" mass="11" fullinertia=".1 .3 .32 .01 0 .004"/>
   <body name="{corner_name} wheel" pos="-.4 {0.1 * side_sign} -.02"><joint name="{corner_name} spin" axis="0 -1 0"/>
    <inertial pos="0 0 0" mass="18" diaginertia=".6 1.2 .6"/>
    <site name="hub_{corner_name}" user="185000 150 58000"/></body></body>"""


SALOON = f"""<mujoco model="saloon"><compiler angle="radian"/><option gravity="0 0 -9.81"/>
<worldbody><geom name="road" type="plane" size="50 50 1"/>
 <body name="body" pos="0 0 .55"><freejoint name="root"/>
  <inertial pos="-.05 .01 .02" mass="1150" fullinertia="420 1750 1950 12 -25 4"/>
  <site name="driver" pos="0 .35 .1"/>
  {_front_strut_text("fl", 1)}{_front_strut_text("fr", -1)}{_rear_arm_text("rl", 1)}{_rear_arm_text("rr", -1)}
  <body name="engine" pos="1.1 .05 .05"><joint name="engine roll" axis="1 0 0" stiffness="60000" damping="400"/>
   <joint name="engine bounce" type="slide" axis="0 0 1" stiffness="400000" damping="1500"/>
   <inertial pos=".1 0 .05" mass="140" diaginertia="7 14 13"/></body>
 </body></worldbody>
<tendon>
 <fixed name="front bar" stiffness="9000">
  <joint joint="fl travel" coef="1"/><joint joint="fr travel" coef="-1"/></fixed>
 <fixed name="rear bar" stiffness="900" damping="4">
  <joint joint="rl swing" coef="1"/><joint joint="rr swing" coef="-1"/></fixed>
 <fixed name="axle drive"><joint joint="rl spin" coef="-.5"/><joint joint="rr spin" coef="-.5"/></fixed></tendon>
<equality><joint name="rack" joint1="fl steer" joint2="fr steer"/></equality>
<actuator><position name="steering" joint="fl steer" kp="500"/>
 <motor name="engine torque" tendon="axle drive"/></actuator>
</mujoco>"""
