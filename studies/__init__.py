"""Studies: one script per engineering question, run as ``python studies/NAME.py`` or ``twinrig run SCENE``.

A study is a module with ``run(scene, engines, output_folder, report_progress) -> summary``: it writes results and
figures into the folder and returns what ``--json`` prints. If it has ``Options``, a scene may set them; if it
has ``check(scene, engines)``, that is called before anything is written. Scenes are in ``scenes/``; a scene's
``study`` key names the study that runs it.
"""
