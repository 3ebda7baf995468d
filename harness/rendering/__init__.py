"""The report document as HTML, Markdown, JUnit and terminal text."""
