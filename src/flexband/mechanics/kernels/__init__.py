"""What is evaluated in every step, compiled; and the quadratic forms that describe it."""
