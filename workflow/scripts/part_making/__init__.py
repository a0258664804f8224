"""Options of `make_parts.py`, and writers of meshes, outlines, drawings and lists of parts."""
