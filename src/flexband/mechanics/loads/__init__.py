"""Gravity, forces, springs, brakes and force laws: what they enter in the equations."""
