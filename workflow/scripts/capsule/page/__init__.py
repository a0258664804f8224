"""The report: functions that turn tables into one HTML page."""
