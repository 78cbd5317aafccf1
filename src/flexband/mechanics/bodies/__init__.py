"""Rigid bodies, point masses, beams and cables; their coordinates and masses."""
