"""The assembled sheet without known light, from a moving camera."""
