"""How moments over random variables are integrated where phases turn, and a second rule."""
