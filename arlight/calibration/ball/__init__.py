"""A mirrored ball: photographs of it become the light around the sheet."""
