/* The stepper motor that drives the wave: all speeds and positions are those of the wave.
 *
 * docs/bench.md describes the mechanism and its numbers. */
#ifndef MOTION_H
#define MOTION_H

#include <stdbool.h>
#include <stdint.h>

/* The cam shaft makes one wave per turn; a belt drives it 60:20 from the motor. */
#define WAVES_PER_MOTOR_TURN 3
#define WAVELENGTH_UM 80000L

/* 28BYJ-48: 64 half-steps per turn of the rotor. Its four gear pairs 32/9, 22/11, 26/9 and 31/10
 * make 63.684 to 1 (not 64 as on the label), so 4075.77 half-steps per turn of the shaft. */
#define HALF_STEPS_PER_TURN_NUMERATOR (64L * 32 * 22 * 26 * 31)
#define HALF_STEPS_PER_TURN_DENOMINATOR (9L * 11 * 9 * 10)

/* Unloaded, the motor starts from rest at up to 600 half-steps/s and follows a ramp up to 1000. */
#define START_RATE 50 /* half-steps/s without a ramp */
#define MAX_RATE 800  /* half-steps/s: the cam needs the rest of the torque */

#define MIN_SPEED_UM_S 500 /* below, a half-step lasts longer than Timer1 can count */

#define DEFAULT_SPEED_UM_S 25000
#define DEFAULT_RAMP_UM_S2 25000
#define MIN_RAMP_UM_S2 1000
#define MAX_RAMP_UM_S2 100000

typedef enum { STOPPED, RUNNING, STOPPING } motion_state_t;

typedef struct {
    uint32_t uptime_ms;
    int32_t half_steps;  /* since the board started; forward counts upward */
    int64_t position_um; /* of the wave: at 25 mm/s, 32 bits last a day */
    int32_t speed_um_s;  /* now, negative backward */
    motion_state_t state;
    bool has_index; /* the cam shaft has passed its index since the board started */
    int32_t index;  /* half-steps at the last passage */
} motion_t;

/* Return thousandths of a half-step/s for a speed: 16.98 half-steps move the wave by 1 mm. */
int32_t milli_rate(int32_t speed_um_s);
/* Return the way of the wave in half-steps, or in thousandths of them (`per_step` = 1000). */
int64_t wave_um(int32_t steps, int32_t per_step);

void motion_begin(void);
motion_t motion_read(void);

/* Return the half-steps per second for a speed of the wave. */
uint32_t motion_rate(int32_t speed_um_s);
int32_t motion_max_speed_um_s(void);

void motion_set_speed(int32_t speed_um_s); /* within MIN_SPEED_UM_S .. motion_max_speed_um_s() */
void motion_set_ramp(int32_t ramp_um_s2);  /* within MIN_RAMP_UM_S2 .. MAX_RAMP_UM_S2 */
/* Stop the wave this long after the last renewal; 0: never. The time at rest does not count. */
void motion_set_lease(uint32_t lease_ms);
void motion_renew_lease(void);

/* Return whether the interrupts have come since the last call: a step, or at rest an overflow. */
bool motion_goes_on(void);

void motion_set_backward(bool backward);
void motion_start(void);
void motion_stop(void);

#endif
