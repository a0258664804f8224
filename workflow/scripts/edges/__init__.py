"""Modules that read files, settings and command lines for the scripts, and write their results."""
