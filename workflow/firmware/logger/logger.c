/* Logger: reads the four sensors of the capsule ten times per second, on an Arduino Mega 2560.
 *
 * Timer1 counts 0.1 s in hardware. Its interrupt starts the first conversion, and each conversion
 * starts the next one, so the main program does not affect the times of samples. Between samples
 * the processor sleeps in idle mode. The quieter "ADC noise reduction" mode would stop Timer1 and
 * the UART. Commands and frames: docs/protocol.md; wiring: docs/bench.md. */
#if !__has_include(<capsule_frame.h>)
#error "Arduino IDE: set File > Preferences > Sketchbook location to workflow/firmware"
#endif
#include <avr/interrupt.h>
#include <avr/io.h>
#include <avr/sleep.h>
#include <capsule_commands.h>
#include <capsule_frame.h>
#include <capsule_serial.h>
#include <capsule_switch.h>
#include <string.h>

#define FIRMWARE_VERSION "1.1"
#define CHANNELS 4
#define RATE_HZ 10
#define PERIOD_MS (1000 / RATE_HZ)
#define TIMER_HZ (F_CPU / 64)
#define VREF_MV 5000
#define SERIES_OHM 12000

#define END_STOP_PIN PE4 /* digital pin 2; without an end stop, connected to ground */
#define LAMP_PIN PB7     /* digital pin 13: the board's own LED, on while running */

static volatile bool running;
static volatile uint32_t periods; /* periods of Timer1 since the board started */

/* The present sample, which is complete when `sampled` is set. */
static volatile uint16_t counts[CHANNELS];
static volatile uint8_t channel;
static volatile uint32_t sample_ms;
static volatile bool sampled;

static void select_channel(uint8_t next) {
    channel = next;
    ADMUX = 1 << REFS0 | next; /* reference: AVCC, which also supplies the sensors */
}

ISR(TIMER1_COMPA_vect) {
    periods++;
    if (running) {
        ADCSRA |= 1 << ADSC;
        sample_ms = periods * PERIOD_MS;
    }
}

ISR(ADC_vect) {
    counts[channel] = ADC;
    if (channel + 1 < CHANNELS) {
        select_channel(channel + 1);
        ADCSRA |= 1 << ADSC;
    } else {
        select_channel(0);
        sampled = true;
    }
}

static void begin_sampling(void) {
    DIDR0 = (1 << CHANNELS) - 1;          /* no digital inputs on A0..A3 */
    ADCSRA = 1 << ADEN | 1 << ADIE | 0x7; /* 125 kHz: full 10 bits, 0.1 ms per conversion */
    select_channel(0);
    TCCR1A = 0;
    TCCR1B = 1 << WGM12 | 1 << CS11 | 1 << CS10; /* clear on compare, F_CPU / 64 */
    OCR1A = TIMER_HZ / RATE_HZ - 1;
    TIMSK1 = 1 << OCIE1A;
}

static uint32_t uptime_ms(void) {
    cli();
    uint32_t elapsed = periods;
    uint16_t count = TCNT1;
    if (TIFR1 & 1 << OCF1A) { /* the period ended after interrupts were disabled */
        elapsed++;
        count = TCNT1;
    }
    sei();
    return elapsed * PERIOD_MS + count / (TIMER_HZ / 1000);
}

/* Return whether the switch was pressed in two samples in a row, to ignore bounces and spikes. */
static bool at_end_stop(void) {
    static bool pressed_before;
    bool high = PINE & 1 << END_STOP_PIN;
    bool pressed = high == NORMALLY_CLOSED;
    bool at_end = pressed && pressed_before;
    pressed_before = pressed;
    return at_end;
}

static void send_identity(void) {
    frame_t frame;
    start_identity(&frame, "logger", FIRMWARE_VERSION);
    frame_add_key(&frame, "rate_hz");
    frame_add_count(&frame, RATE_HZ);
    frame_add_key(&frame, "channels");
    frame_add_count(&frame, CHANNELS);
    frame_add_text(&frame, "adc_bits=10");
    frame_add_key(&frame, "vref_mv");
    frame_add_count(&frame, VREF_MV);
    frame_add_key(&frame, "series_ohm");
    frame_add_count(&frame, SERIES_OHM);
    frame_add_text(&frame, running ? "state=running" : "state=paused");
    frame_add_key(&frame, "uptime_ms");
    frame_add_count(&frame, uptime_ms());
    serial_send(&frame);
}

static void send_sample(void) {
    static uint32_t sequence;
    frame_t frame;
    frame_start(&frame, "D");
    frame_add_count(&frame, sequence++);
    frame_add_count(&frame, sample_ms);
    for (uint8_t i = 0; i < CHANNELS; i++) {
        frame_add_count(&frame, counts[i]);
    }
    frame_add_count(&frame, at_end_stop());
    serial_send(&frame);
}

static void set_running(bool wanted) {
    running = wanted;
    if (wanted) {
        PORTB |= 1 << LAMP_PIN;
    } else {
        PORTB &= (uint8_t) ~(1 << LAMP_PIN);
    }
}

static void obey(char *command) {
    char *argument = split_argument(command);
    if (*argument) {
        refuse(command, "takes no argument");
    } else if (strcmp(command, "identify") == 0) {
        send_identity();
    } else if (strcmp(command, "start") == 0 || strcmp(command, "pause") == 0) {
        set_running(command[0] == 's');
        acknowledge(command, "");
    } else {
        refuse(command, "unknown; the logger knows identify start pause");
    }
}

int main(void) {
    set_sleep_mode(SLEEP_MODE_IDLE);
    DDRB |= 1 << LAMP_PIN;
    PORTE |= 1 << END_STOP_PIN; /* pull-up */
    serial_begin();
    begin_sampling();
    sei();
    send_identity();
    for (;;) {
        if (sampled) {
            sampled = false;
            send_sample();
        }
        receive_commands(obey, send_identity);
        serial_sleep(&sampled);
    }
}
