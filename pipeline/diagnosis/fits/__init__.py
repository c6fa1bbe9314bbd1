"""Models fitted to what was observed: base, extended by candidates, data faults, identified again, held-out steps."""
