"""Independent reference in plain numpy: a vehicle in space from its description, without any code that an engine uses.

``motion`` differentiates the product of the joints' matrices (Lagrange's equations by pseudo-inertia matrices, Uicker
1965), ``parts`` has springs, dampers and bars, ``statics`` what holds the design position, ``march`` the classical
Runge-Kutta method. ``hubs`` drives a vehicle that is cut at its wheels, ``rolling`` one on brush tyres (``bristles``,
``road``). Nothing here is compiled, reads a table of numbers, or calls a function of the compiled tree.
"""
