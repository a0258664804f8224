"""Record from the bench: serial ports, boards, files of recordings, and the display.

`protocol` decodes the bytes on the serial line. `timeline` places samples in time, `archive` writes
them, `terminal` and `window` show them, and `session` runs one recording. The demo and the tests
need no hardware: `stand_in` imitates the logger, `cable` connects it, `workbench` runs its clock.
"""
