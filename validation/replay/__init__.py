"""Answers of the command line, recorded and replayed: a net under work that must not change a value.

``python -m validation.replay record FOLDER`` runs all shipped scenes and 300 varied ones through the command line alone
and keeps exit codes, messages and every saved channel; ``python -m validation.replay check FOLDER`` runs them again and
tells what differs. Nothing here imports the code that it watches.
"""
