"""Export recordings and results for other programs.

`gathering` reads the results, and `formats` writes them, so all formats hold the same values, units
and provenance.
"""
