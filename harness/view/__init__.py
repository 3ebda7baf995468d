"""`crosscheck view`: the sources of one robot side by side in a local page, with a slider for each joint."""
