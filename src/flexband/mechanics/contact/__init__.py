"""Laws of contact and friction, which loads and joints share."""
