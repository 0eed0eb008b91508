"""A braked vehicle on its suspension in MuJoCo, compiled as a whole: steps, and samples of them."""

from models.brake import samples
from models.brake.sprung_step import compiled
from models.engines.mujoco_native import accelerate, march

advance = compiled(accelerate, march, "in_mujoco")
by_steps = samples.compiled(advance, "by_steps_in_mujoco")
