"""The printer: tone curve, and the error that a sheet printed on it will have."""
