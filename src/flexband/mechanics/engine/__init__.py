"""Initial conditions, generalized-α and projection on lanes of samples; failures and warnings."""
