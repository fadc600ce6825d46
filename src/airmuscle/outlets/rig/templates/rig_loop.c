/* Loop of 1 kHz for Linux that plays plan.h on a rig and counts missed deadlines.

   Write the three functions of rig.h for your hardware, then

       cc -std=c11 -O2 -Wall -Wextra rig_loop.c my_rig.c -o rig_loop
       sudo ./rig_loop --start > record.csv

   Nothing moves without --start. Whatever ends the loop (the end of the plan, a signal, a failed
   function, a reading beyond the limits, too many missed deadlines) calls rig_stop, which must vent.
   A program that is killed by SIGKILL cannot vent: the hardware needs a watchdog of its own that
   vents when rig_write is not called for WATCHDOG_NS. */
#define _GNU_SOURCE
#include <math.h>
#include <sched.h>
#include <signal.h>
#include <stdio.h>
#include <string.h>
#include <sys/mman.h>
#include <time.h>

#include "plan.h"

/* rig.h: each returns 0 on success. Pressures are gauge pressures in Pa. */
int rig_write(const float *command, int count);
int rig_read(float *pressure, int count);
void rig_stop(void);

#ifndef PERIOD_NS
#define PERIOD_NS 1000000L
#endif
#ifndef WATCHDOG_NS
#define WATCHDOG_NS 100000000L
#endif
#ifndef MARGIN_PA
#define MARGIN_PA 30000.0f /* overshoot of a regulator beyond the greatest command */
#endif

static volatile sig_atomic_t stopped = 0;

static void on_signal(int number) { stopped = number; }

static long long now_ns(void) {
    struct timespec t;
    clock_gettime(CLOCK_MONOTONIC, &t);
    return (long long)t.tv_sec * 1000000000LL + t.tv_nsec;
}

static void wait_until(long long deadline) {
    struct timespec t = {.tv_sec = deadline / 1000000000LL, .tv_nsec = deadline % 1000000000LL};
    while (!stopped && clock_nanosleep(CLOCK_MONOTONIC, TIMER_ABSTIME, &t, NULL) != 0) {
    }
}

static void catch_signals(void) {
    const int numbers[] = {SIGINT, SIGTERM, SIGHUP, SIGQUIT, SIGPIPE};
    struct sigaction action;
    memset(&action, 0, sizeof action);
    action.sa_handler = on_signal;
    for (size_t i = 0; i < sizeof numbers / sizeof numbers[0]; i++) sigaction(numbers[i], &action, NULL);
}

static void raise_priority(void) {
    struct sched_param priority = {.sched_priority = 80};
    if (sched_setscheduler(0, SCHED_FIFO, &priority) != 0)
        fprintf(stderr, "no real-time priority: start as root, or grant CAP_SYS_NICE\n");
    if (mlockall(MCL_CURRENT | MCL_FUTURE) != 0) fprintf(stderr, "memory is not locked\n");
}

/* NULL, or the reason for which the loop must end. */
static const char *play_row(long row, long long elapsed) {
    float pressure[PLAN_COMMANDS];
    if (rig_write(plan_pressure_pa[row], PLAN_COMMANDS) != 0) return "rig_write failed";
    if (rig_read(pressure, PLAN_COMMANDS) != 0) return "rig_read failed";
    printf("%.6f", 1e-9 * (double)elapsed);
    for (int i = 0; i < PLAN_COMMANDS; i++)
        printf(",%.1f,%.1f", (double)plan_pressure_pa[row][i], (double)pressure[i]);
    printf("\n");
    for (int i = 0; i < PLAN_COMMANDS; i++)
        if (!isfinite(pressure[i]) || pressure[i] > PLAN_MAX_PRESSURE_PA + MARGIN_PA)
            return "a pressure is beyond its limit";
    return NULL;
}

int main(int count, char **arguments) {
    if (count != 2 || strcmp(arguments[1], "--start") != 0) {
        fprintf(stderr, "%d rows of %ld us; give --start to play them\n", PLAN_ROWS,
                PLAN_SAMPLE_TIME_NS / 1000L);
        return 2;
    }
    catch_signals();
    raise_priority();
    printf("time [s]");
    for (int i = 0; i < PLAN_COMMANDS; i++) {
        if (PLAN_COMMANDS == 1) printf(",setpoint [Pa],pressure [Pa]");
        else printf(",m%d.setpoint [Pa],m%d.pressure [Pa]", i + 1, i + 1);
    }
    printf("\n");
    const char *reason = NULL;
    long missed = 0, periods = 0;
    long long worst = 0, begin = now_ns(), deadline = begin;
    while (!stopped && reason == NULL) {
        long long late = now_ns() - deadline;
        if (late > worst) worst = late;
        if (late > PERIOD_NS) {
            missed += late / PERIOD_NS;
            deadline += late / PERIOD_NS * PERIOD_NS;
        }
        long row = (long)((deadline - begin) / PLAN_SAMPLE_TIME_NS);
        if (row >= PLAN_ROWS) break;
        if (late > WATCHDOG_NS) reason = "the watchdog: a period was too late";
        else reason = play_row(row, deadline - begin);
        periods++;
        deadline += PERIOD_NS;
        wait_until(deadline);
    }
    rig_stop();
    if (stopped) fprintf(stderr, "stopped by signal %d\n", (int)stopped);
    if (reason != NULL) fprintf(stderr, "stopped: %s\n", reason);
    fprintf(stderr, "%ld periods, %ld missed deadlines, latest by %.1f us\n", periods, missed,
            1e-3 * (double)worst);
    return stopped || reason != NULL;
}
