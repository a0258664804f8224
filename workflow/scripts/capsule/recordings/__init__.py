"""What a recording is: its name, header, units and time, and whether it is accepted."""
