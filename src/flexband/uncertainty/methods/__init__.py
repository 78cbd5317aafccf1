"""Methods with given orders, and samplings; they import no phases."""
