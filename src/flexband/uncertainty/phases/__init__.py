"""Ringing responses as carriers, phases and envelopes; their moments and bounds."""
