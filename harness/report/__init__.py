"""The report document: its types, the words that every format shares, JSON."""
