"""The braked vehicle on its suspension once more, in plain numpy: the independent reference of its compiled step.

It follows the same scheme (the wheel exact within a step, mean forces to the vehicle, Runge and Kutta's method for the
rest) and shares no compiled function with it. It is slow, and is asked for by name: ``--engine reference``.
"""
