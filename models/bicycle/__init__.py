"""Whipple's bicycle: linear equations, nonlinear motion with ideal rolling, tyres for engines, and comparison with
measured weave.
"""
