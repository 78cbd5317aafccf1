"""Motion, statics and modes of mechanisms; uncertainty is not known here."""
