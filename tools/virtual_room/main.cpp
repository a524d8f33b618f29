// bristle-room: the paper's virtual room, in a window or without one.
#include <cstdio>
#include <exception>
#include <map>
#include <string>

#include <CLI/CLI.hpp>

#include "tools/cli/user_error.hpp"
#include "tools/virtual_room/haptic_loop.hpp"
#include "tools/virtual_room/headless.hpp"
#include "tools/virtual_room/run_options.hpp"
#include "tools/virtual_room/screen.hpp"

namespace {

using room::RunOptions;

void add_options(CLI::App& app, RunOptions& o) {
  const std::map<std::string, room::DeviceKind> devices = {{"mouse", room::DeviceKind::mouse},
                                                           {"script", room::DeviceKind::script},
                                                           {"file", room::DeviceKind::file},
                                                           {"udp", room::DeviceKind::udp}};
  const std::map<std::string, bool> clocks = {{"real", false}, {"virtual", true}};
  app.add_flag("--headless", o.headless, "no window");
  app.add_option("--script", o.script, "TOML: settings and the motion of a scripted hand")
      ->check(CLI::ExistingFile);
  app.add_option("--device", o.device, "what moves the tool: mouse, script, file or udp")
      ->transform(CLI::CheckedTransformer(devices, CLI::ignore_case));
  app.add_option("--motion", o.motion, "CSV of a recorded hand, for --device file")->check(CLI::ExistingFile);
  app.add_option("--port", o.udp_port, "UDP port on loopback, for --device udp")
      ->check(CLI::Range(1, 65535))
      ->capture_default_str();
  app.add_option("--clock", o.virtual_clock, "real, or virtual: step without waiting (headless)")
      ->transform(CLI::CheckedTransformer(clocks, CLI::ignore_case));
  app.add_option("--rate", o.loop.rate_hz, "ticks a second")->check(CLI::Range(1000.0, 10000.0));
  app.add_option("--seconds", o.seconds, "of the simulation; 0 = to the end of the script")
      ->check(CLI::Range(0.0, 1e6));
  app.add_option("--csv", o.csv, "forces, position and loads, a row per tick and patch");
  app.add_option("--frames", o.frames, "folder for pictures (headless)");
  app.add_option("--fps", o.frames_per_second, "pictures a second of the simulation")
      ->check(CLI::Range(0.1, 1000.0))
      ->capture_default_str();
}

void add_picture_options(CLI::App& app, RunOptions& o) {
  app.add_option("--width", o.picture.width, "of window and pictures, pixels")
      ->check(CLI::Range(320, 7680))
      ->capture_default_str();
  app.add_option("--height", o.picture.height, "pixels")->check(CLI::Range(240, 4320))->capture_default_str();
  app.add_option("--scale", o.picture.scale, "of type and panels; 0 = as the display asks")
      ->check(CLI::Range(0.0, 4.0));
  app.add_flag("!--no-panels", o.picture.panels, "pictures of the room alone");
  app.add_option("--stall-graphics", o.stall_graphics_ms, "ms that the graphic loop stands still, once a second")
      ->check(CLI::Range(0.0, 10000.0))
      ->group("");  // for tests
}

int run(const RunOptions& options) {
  room::HapticLoop loop(options.loop);
  if (!options.headless) {
#if BRISTLE_ROOM_SCREEN
    return room::show_window(options, loop);
#else
    throw cli::UserError("this build has no window; run with --headless");
#endif
  }
  room::DrawFrame draw;
  if (!options.frames.empty()) {
#if BRISTLE_ROOM_SCREEN
    draw = room::draw_into(options, loop);
#else
    throw cli::UserError("--frames: this build draws no pictures");
#endif
  }
  room::run_headless(options, loop, draw);
  return 0;
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App app("The virtual room: a block, a hand, and friction by bristles", "bristle-room");
  RunOptions options;
  add_options(app, options);
  add_picture_options(app, options);
  CLI11_PARSE(app, argc, argv);
  try {
    return run(options);
  } catch (const std::exception& e) {
    std::fprintf(stderr, "bristle-room: %s\n", e.what());
    return 2;
  }
}
