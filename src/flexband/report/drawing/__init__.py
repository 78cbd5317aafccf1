"""The pens: Matplotlib and SVG."""
