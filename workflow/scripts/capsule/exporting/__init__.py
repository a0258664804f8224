"""Export recordings and results for other programs; each format has one module.

`gathering` reads the results into the classes of `exported`. The module of each format writes these
classes, so all formats hold the same values, units and provenance.
"""
