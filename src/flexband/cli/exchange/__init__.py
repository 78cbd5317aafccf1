"""The commands that exchange runs with other programs: points, tables, exports."""
