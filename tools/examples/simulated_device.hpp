// A haptic device that exists only in memory. Its interface has the shape of OpenHaptics' HDAPI, so that the
// callback of servo_callback.cpp reads as it would there; each function names the call that it stands for.
// Behind the interface: a stylus of 50 g held by a hand (a spring and a damper towards where the hand aims),
// three encoders, a force that is held for a tick, a servo thread at 1 kHz.
#pragma once

#include <bristle/bristle.hpp>

namespace device {

enum CallbackCode { callback_done, callback_continue };  // HD_CALLBACK_DONE, HD_CALLBACK_CONTINUE
using Callback = CallbackCode (*)(void* user);           // HDSchedulerCallback

enum Parameter {
  current_position,   // position, three numbers, mm (HD_CURRENT_POSITION)
  current_force,      // force to send to the device, three numbers, N (HD_CURRENT_FORCE)
  nominal_max_force,  // HD_NOMINAL_MAX_FORCE: N
};

void begin_frame();                                      // hdBeginFrame(hdGetCurrentDevice())
void end_frame();                                        // hdEndFrame(hdGetCurrentDevice())
void get_doublev(Parameter what, double* values);        // hdGetDoublev
void set_doublev(Parameter what, const double* values);  // hdSetDoublev

void schedule_asynchronous(Callback callback, void* user);  // as hdScheduleAsynchronous with default priority
void start_scheduler();                                     // as hdStartScheduler: starts the servo thread
bool is_scheduled();    // hdWaitForCompletion(handle, HD_WAIT_CHECK_STATUS): whether a callback is scheduled
void stop_scheduler();  // as hdStopScheduler: waits until the callback has ended

// Sets where the simulated hand aims. (The functions below serve tests; a real device lacks them.)
void set_hand(void (*where)(double time_s, double (&metres)[3]));  // place that the hand aims at, m

// Returns the position of the stylus without encoder error, m, for tests. Call it in the callback, or once
// the scheduler has stopped.
double true_position(int axis);
// Returns the run times of the callback. Call it once the scheduler has stopped.
const bristle::DeadlineMonitor& servo_times();

constexpr double encoder_count = 23e-6;  // m
constexpr double tick = 1e-3;            // s

}  // namespace device
