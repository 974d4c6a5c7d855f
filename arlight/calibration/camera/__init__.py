"""The camera: intrinsics, response to light, exposure."""
