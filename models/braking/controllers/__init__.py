"""Controllers of anti-lock brakes, one file each; all decide wheel by wheel, or axle by axle where they select low."""

from models.braking.controller import AllApplied
from models.braking.controllers.acceleration_phases import AccelerationPhases
from models.braking.controllers.five_phase import FivePhase
from models.braking.controllers.slip_bang_bang import SlipBangBang
from models.braking.controllers.slip_pi import SlipPI

CONTROLLERS = {
    "none": AllApplied,
    "slip_bang_bang": SlipBangBang,
    "acceleration_phases": AccelerationPhases,
    "five_phase": FivePhase,
    "slip_pi": SlipPI,
}
"""By the names that scenes give them; each is made from the number of wheels and its parameters."""
