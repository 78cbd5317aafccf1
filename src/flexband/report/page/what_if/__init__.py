"""The panel in which a reader moves inputs: the surrogate in the reader's browser."""
