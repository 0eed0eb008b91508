"""Independent reference, in plain numpy, of the compiled time step of a braked vehicle on its suspension.

It follows the same scheme (the wheel exact within a step, mean forces to the vehicle, Runge and Kutta's method for the
rest) and shares no compiled function with it. It is slow, and is asked for by name: ``--engine reference``.
"""
