"""Two batches of placements in, discrepancies and statistics out."""
