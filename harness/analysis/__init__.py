"""How far apart sources are, and for which q. Knows no engine, only placements."""
