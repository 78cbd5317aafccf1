"""All that draws and words results; only the command line imports it."""
