"""Madelung: piezo hysteresis predicted open loop, and why prediction and reality differ."""

__version__ = "0.1.0"
