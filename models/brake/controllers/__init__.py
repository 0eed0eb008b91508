"""Controllers of anti-lock brakes; all decide wheel by wheel, or for a whole axle where its wheels share the pressure
that the slower one needs.
"""

from models.brake.controller import NoAntiLock
from models.brake.controllers.acceleration_phases import AccelerationPhases
from models.brake.controllers.five_phase import FivePhase
from models.brake.controllers.slip import SlipBangBang, SlipPI

CONTROLLERS = {
    "none": NoAntiLock,
    "slip_bang_bang": SlipBangBang,
    "acceleration_phases": AccelerationPhases,
    "five_phase": FivePhase,
    "slip_pi": SlipPI,
}
"""Controller classes by the names that scenes give them; each takes the number of wheels and its parameters."""
