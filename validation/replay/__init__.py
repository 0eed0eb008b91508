"""Outputs of the command line, recorded and replayed: a check that a change of the code changes no result.

``python -m validation.replay record FOLDER`` runs all shipped scenes and 300 varied ones through the command line alone
and keeps exit codes, messages and every saved channel; ``python -m validation.replay check FOLDER`` runs them again and
tells what differs. Nothing here imports the code that it watches.
"""
