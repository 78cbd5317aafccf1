"""What is read of a motion: places, forces, energies; extremes over steps."""
