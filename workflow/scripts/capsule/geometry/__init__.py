"""Geometry of the capsule and of the bench's parts: corners, outlines, distances, cams."""
