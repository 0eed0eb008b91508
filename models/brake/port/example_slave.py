"""Example of a controller as an FMU. Build: ``pythonfmu build -f example_slave.py``."""

import numpy as np
from pythonfmu import Boolean, Fmi2Causality, Fmi2Slave, Fmi2Variability, Real

from models.brake.controller import Sample
from models.brake.port.example import Example


class ExampleSlave(Fmi2Slave):
    """FMU of the example controller for four wheels, whose outputs are valve states."""

    def __init__(self, **kwargs: object) -> None:
        super().__init__(**kwargs)
        self.supply, self.speed, self.brake = 0.0, 0.0, False
        for i in range(1, 5):
            setattr(self, f"wheel_{i}", 0.0)
            setattr(self, f"valve_{i}", -1.0)
            self.register_variable(Real(f"wheel_{i}", causality=Fmi2Causality.input))
            self.register_variable(Real(f"valve_{i}", causality=Fmi2Causality.output))
        for name in ("supply", "speed"):
            self.register_variable(Real(name, causality=Fmi2Causality.input))
        self.register_variable(Boolean("brake", causality=Fmi2Causality.input, variability=Fmi2Variability.discrete))
        self._number, self._controller = 0, Example(4)

    def do_step(self, current_time: float, step_size: float) -> bool:
        """Set the outputs to the controller's command for the present inputs."""
        wheels = np.array([getattr(self, f"wheel_{i}") for i in range(1, 5)])
        sample = Sample(self._number, round(1e9 * current_time), wheels, self.brake, self.supply, self.speed)
        valves = self._controller.sample(sample).valves
        assert valves is not None
        for i, valve in enumerate(valves.tolist(), 1):
            setattr(self, f"valve_{i}", float(valve))
        self._number += 1
        return True
