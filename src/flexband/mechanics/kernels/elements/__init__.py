"""Elements of beams and cables: energy, forces and tangents, compiled."""
