"""Which change makes both sides agree."""
