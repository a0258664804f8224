// The Arduino IDE opens this folder through this file; the program is fold.c, with its own main().
//
// Once: File > Preferences > Sketchbook location: the folder workflow/firmware of this project, so
// that the IDE finds the library CapsuleLine. Then choose "Arduino Uno" and upload.
#ifndef __AVR_ATmega328P__
#error "This firmware is for the Arduino UNO: choose it under Tools > Board"
#endif
