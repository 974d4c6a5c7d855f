"""Fitting the model to the sheet, the camera and the printer that are there."""
