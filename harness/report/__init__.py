"""Telling it: JSON, HTML, Markdown, JUnit. Knows only the report document."""
