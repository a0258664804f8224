#include "capsule_motor.h"

#include <avr/io.h>

#define COILS 0x0F

static const uint8_t HALF_STEP_COILS[8] = {0x1, 0x3, 0x2, 0x6, 0x4, 0xC, 0x8, 0x9};

void motor_begin(void) {
    DDRB |= COILS;
}

void motor_hold(uint8_t half_step) {
    PORTB = (PORTB & (uint8_t)~COILS) | HALF_STEP_COILS[half_step & 7];
}

void motor_release(void) {
    PORTB &= (uint8_t)~COILS;
}
