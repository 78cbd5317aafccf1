"""Tables, numbers, doubts and verdicts in words."""
