"""The controller port: the interface at which a brake controller is called once per sample, and every kind of
controller behind it.

    frame.py        both frames byte by byte, for another process and for the log
    ask.py          one exchange: what a controller answers is checked, whatever it runs in
    hosted.py       a callable or an FMU in a process of its own, ended when its time is over; host.py is its other end
    callable.py     a Python class, named as "module:Name" or "file.py:Name"
    socket_port.py  a second process over a loopback socket; client.py and client_example.c are its other end
    fmu_port.py     an FMU, FMI 2 co-simulation; example_slave.py is one
    example.py      the controller that both examples are
    sensors.py      signals with gain, offset, noise and bits; teeth.py counts them from a toothed wheel with a timer
    faults.py       lost and delayed samples, stuck valves
    log.py          every exchange in a file, and a controller that replays it
    pace.py         the clock on the wall
    setup.py        all of it as a scene gives it, opened and closed again

All are controllers (``models.brake.controller``), and those that change or watch an exchange hold another one.
"""
