"""What runs warn of, as data: kinds, how they are collected, which outputs they touch.

It imports nothing of flexband: whatever warns may use it.
"""
