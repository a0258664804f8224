"""The report: tables in, one HTML page out."""
