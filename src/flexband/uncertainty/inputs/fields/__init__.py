"""Random and interval fields, and the series that they are expanded into."""
