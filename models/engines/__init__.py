"""Engines: Exudyn, MuJoCo and the hand-written reference behind one protocol."""
