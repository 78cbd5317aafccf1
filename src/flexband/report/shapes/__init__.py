"""What a mechanism looks like, as strokes that any pen can draw."""
