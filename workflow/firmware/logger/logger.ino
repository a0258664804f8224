// The Arduino IDE needs this file to open the folder. The program and its main() are in logger.c.
//
// Once: set File > Preferences > Sketchbook location to the folder workflow/firmware of this
// project, so that the IDE finds the library CapsuleLine. Then choose "Arduino Mega or Mega 2560"
// and upload.
#ifndef __AVR_ATmega2560__
#error "This firmware is for the Arduino Mega 2560: choose it under Tools > Board"
#endif
