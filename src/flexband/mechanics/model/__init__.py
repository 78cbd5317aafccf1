"""A mechanism as data, and behind it its forms: frames, rows of z, equations of motion."""
