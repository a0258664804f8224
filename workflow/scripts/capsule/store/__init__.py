"""Files under raw/ and results/."""
