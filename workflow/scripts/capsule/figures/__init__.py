"""The figures: arrays and tables in, a matplotlib figure out."""
