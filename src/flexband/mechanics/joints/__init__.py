"""Joints, gears and drives as rows of constraints."""
