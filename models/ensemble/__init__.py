"""Ensembles: many computations of one scene on any executor, with finished blocks stored and resumed.

::

    job = noise_paths(scene, times, truth)        # of the pitch plane: path i is the scene with force_noise.path = i
    with process_pool(2) as pool:                 # workers.py; or dask_workers("tcp://host:8786"), or None
        found = run_paths(job, 10_000, folder, pool, progress=print)   # runner.py
    found["states"], found["drift_off"]           # (paths, times, 8), (paths,)
"""
