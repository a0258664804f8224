// The Arduino IDE needs this file to open the folder. The program and its main() are in
// peristalsis.c.
//
// Once: set File > Preferences > Sketchbook location to the folder workflow/firmware of this
// project, so that the IDE finds the library CapsuleLine. Then choose "Arduino Uno" and upload.
#ifndef __AVR_ATmega328P__
#error "This firmware is for the Arduino UNO: choose it under Tools > Board"
#endif
