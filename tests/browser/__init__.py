"""Reports and the view as people use them: in a real browser."""
