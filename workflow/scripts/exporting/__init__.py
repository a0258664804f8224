"""Recordings and results for other programs, behind `export.py`: one module a format.

`gathering` reads what is exported into the plain structure of `exported`; each format writes that
structure, so that all of them hold the same values, units and provenance.
"""
