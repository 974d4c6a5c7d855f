"""What a run leaves behind: the log of pose and lighting, and the report that shows it."""
