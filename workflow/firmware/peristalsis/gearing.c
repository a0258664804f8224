/* From half-steps of the motor to millimetres of the wave, and back. */
#include "motion.h"

int32_t milli_rate(int32_t speed_um_s) {
    return (int32_t)((int64_t)speed_um_s * HALF_STEPS_PER_TURN_NUMERATOR * 1000 /
                     ((int64_t)HALF_STEPS_PER_TURN_DENOMINATOR * WAVES_PER_MOTOR_TURN *
                      WAVELENGTH_UM));
}

int64_t wave_um(int32_t steps, int32_t per_step) {
    return (int64_t)steps * HALF_STEPS_PER_TURN_DENOMINATOR * WAVES_PER_MOTOR_TURN *
           WAVELENGTH_UM / ((int64_t)HALF_STEPS_PER_TURN_NUMERATOR * per_step);
}
