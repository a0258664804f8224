"""Turn a laboratory's table into recordings: dialect, columns, time, units, runs, resampling."""
