"""Any two descriptions compared, and which known one a mechanism is."""
