"""A bench without hardware: the boards' real firmware in an emulator, or a stand-in in Python.

`emulated` runs the firmware in libsimavr, `stand_in` imitates the logger in plain Python where
there is no emulator; `cable` joins either to a port that a program opens as it opens a USB port;
`workbench` lets time pass for all of them.
"""
