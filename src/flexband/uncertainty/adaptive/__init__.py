"""The method that finds its own orders, and the error that it expects of itself."""
