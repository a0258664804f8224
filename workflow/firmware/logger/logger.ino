// The Arduino IDE opens this folder through this file; the program is logger.c, with its own main().
//
// Once: File > Preferences > Sketchbook location: the folder workflow/firmware of this project, so
// that the IDE finds the library CapsuleLine. Then choose "Arduino Mega or Mega 2560" and upload.
#ifndef __AVR_ATmega2560__
#error "This firmware is for the Arduino Mega 2560: choose it under Tools > Board"
#endif
