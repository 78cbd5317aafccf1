"""The parts of a study's page; all numbers come from results, none is computed here."""
