/* A 28BYJ-48 motor behind a ULN2003. PB0..PB3 (digital pins 8..11 of an UNO) drive IN1 to IN4, and
 * so the coils at the blue, pink, yellow and orange wires. */
#ifndef CAPSULE_MOTOR_H
#define CAPSULE_MOTOR_H

#include <stdint.h>

void motor_begin(void);

/* Hold the rotor at a half-step; the next or previous half-step turns it. */
void motor_hold(uint8_t half_step);
void motor_release(void); /* switch off the coils to keep them cool; the gear holds the load */

#endif
