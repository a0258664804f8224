"""A bench without hardware: the boards' real firmware in an emulator, on their cables."""
