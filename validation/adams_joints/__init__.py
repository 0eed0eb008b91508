"""Joints and springs of another multibody code: its model files read, built on the common description, compared."""
