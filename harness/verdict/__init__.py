"""From what was found to pass or fail: the only place that decides."""
