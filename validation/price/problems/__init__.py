"""Problems of the work-precision runner: one file each, with what is computed and how its error is taken.

A problem knows its reference solution and that solution's own uncertainty; ``models.advice.price.runner`` does the
rest. A new system adds a file here whose class fulfils ``models.advice.price.problem.Problem``.
"""
