"""A bench without hardware: the boards' real firmware in an emulator.

`emulated` runs the firmware in libsimavr. `cable` connects a board to a
port that a program opens like a USB port. `workbench` advances the time of all
boards. For surveys, `gut` is the capsule in its gut, and `surveyor` runs a survey in step with the
bench. `rig` is a complete bench.
"""
