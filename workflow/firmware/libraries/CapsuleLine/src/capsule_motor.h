/* A 28BYJ-48 behind a ULN2003: its coils at PB0..PB3 (an UNO's digital pins 8..11), through IN1 to
 * IN4 to the blue, pink, yellow and orange wires. */
#ifndef CAPSULE_MOTOR_H
#define CAPSULE_MOTOR_H

#include <stdint.h>

void motor_begin(void);

/* Hold the rotor at a half-step; one more or one fewer than before turns it. */
void motor_hold(uint8_t half_step);
void motor_release(void); /* the gear holds what hangs on it; the coils stay cool */

#endif
