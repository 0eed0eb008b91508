"""Engines: Exudyn, MuJoCo and the reference, one file each behind the protocol of ``protocol.py``."""
