"""Vehicles and motions in space that several systems are tested on."""
