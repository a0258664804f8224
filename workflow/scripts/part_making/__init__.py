"""The edge of `make_parts.py`: its options, the files of meshes, outlines, drawings and lists."""
