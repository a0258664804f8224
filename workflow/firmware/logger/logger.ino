// The Arduino IDE opens this folder through this file; the program is logger.c, with its own main().
//
// Once: File > Preferences > Sketchbook location: the folder workflow/firmware of this project, so
// that the IDE finds the library CapsuleLine. Then choose "Arduino Mega or Mega 2560" and upload.
#if !__has_include(<capsule_frame.h>)
#error "Set File > Preferences > Sketchbook location to workflow/firmware (see docs/bench.md)"
#endif
#include <capsule_frame.h>
#ifndef __AVR_ATmega2560__
#error "The logger is for the Arduino Mega 2560: choose it under Tools > Board"
#endif
