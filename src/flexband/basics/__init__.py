"""What all rooms use: checks, text, files, progress, responses. Imports remarks and errors only."""
