"""The moving picture of a mechanism, and the data that it plays."""
