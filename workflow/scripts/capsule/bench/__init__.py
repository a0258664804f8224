"""Record from the bench: serial ports, boards, files of recordings, and the display.

`protocol` decodes the bytes on the serial line, `board` keeps up the line to one board. `logger`
checks the samples, `timeline` places them in time, `growing_file` writes them, `terminal` shows
them, and `recorder` runs one recording. `wave` and `fold` are the boards that move; `survey_run`
is a survey, which `survey_command` leads with all of them. The tests run the boards in an
emulator: tests/support/bench.
"""
