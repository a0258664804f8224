"""From a laboratory's table to recordings: dialect, time, units, columns, runs, sampling rate."""
