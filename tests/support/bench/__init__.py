"""A bench without hardware: the boards' real firmware in an emulator, or stand-ins in Python.

`emulated` runs the firmware in libsimavr; `acquisition.stand_in` and `stand_in_motors` imitate the
boards in plain Python. `acquisition.cable` joins either to a socket, `cable` to a port that a
program opens as it opens a USB port; `acquisition.workbench` lets time pass for all of them. For
surveys, `gut` is the capsule in its gut, `surveyor` runs survey.py in step with the bench, and
`rig` and `emulated_rig` are all of it.
"""
