"""Recordings from other programs' files into raw/: one module a format, one way for all."""
