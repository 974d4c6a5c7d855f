"""The printed sheet: its layout, its patterns, and what is needed to print it."""
