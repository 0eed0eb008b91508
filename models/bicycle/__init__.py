"""Whipple's bicycle: linear equations, ideal rolling, tyres for engines, and what measurements say of it."""
