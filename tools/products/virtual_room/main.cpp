// Runs bristle-room, the virtual room of the paper, in a window or without one.
#include <cstdio>
#include <exception>
#include <map>
#include <memory>
#include <string>
#include <utility>

#include <CLI/CLI.hpp>

#include <bristle/version.hpp>

#include "tools/libraries/files/user_error.hpp"
#include "tools/products/cli/command_tree.hpp"
#include "tools/products/cli/help_text.hpp"
#include "tools/products/cli/option_checks.hpp"
#include "tools/products/virtual_room/haptic_loop.hpp"
#include "tools/products/virtual_room/presets.hpp"
#include "tools/products/virtual_room/run.hpp"
#include "tools/products/virtual_room/script.hpp"
#include "tools/products/virtual_room/udp_device.hpp"

namespace {

using room::RunOptions;

// Adds the options of bristle-room. Returns the option --device, by which the caller sees whether it was
// given.
CLI::Option* add_options(CLI::App& app, RunOptions& o) {
  const std::map<std::string, room::DeviceKind> devices = {{"mouse", room::DeviceKind::mouse},
                                                           {"script", room::DeviceKind::script},
                                                           {"file", room::DeviceKind::file},
                                                           {"udp", room::DeviceKind::udp}};
  app.set_version_flag("--version", std::string("bristle-room ") + bristle::library_version());
  app.add_flag("--headless", o.headless, "no window");
  app.add_flag("--tour", o.tour, "begin with a tour of 20 seconds");
  app.add_option("--script", o.script, "TOML: settings and the motion of a scripted hand")
      ->check(CLI::ExistingFile)
      ->type_name(cli::file_value);
  CLI::Option* device =
      app.add_option_function<std::string>(
             "--device", [&o, devices](const std::string& name) { o.device = devices.at(name); },
             "what moves the tool; by default the mouse, or the file given")
          ->check(cli::one_of({"mouse", "script", "file", "udp"}))
          ->type_name("mouse|script|file|udp");
  app.add_option("--motion", o.motion, "CSV of a recorded hand, for --device file")
      ->check(CLI::ExistingFile)
      ->type_name(cli::file_value);
  app.add_option("--port", o.udp_port, "UDP port on loopback, for --device udp")
      ->check(cli::within(1, 65535))
      ->capture_default_str();
  app.add_option_function<std::string>(
         "--clock", [&o](const std::string& name) { o.virtual_clock = name == "virtual"; },
         "virtual: step without waiting (headless)")
      ->check(cli::one_of({"real", "virtual"}))
      ->type_name("real|virtual");
  app.add_option("--rate", o.loop.rate_hz, "ticks a second")->check(cli::within(1000.0, 10000.0));
  app.add_option("--seconds", o.seconds, "of the simulation; 0 = to the end of the script")
      ->check(cli::within(0.0, 1e6));
  app.add_option("--csv", o.csv, "write forces, position and loads, a row per tick and patch")
      ->type_name(cli::file_value);
  app.add_option("--record", o.loop.record_to, "name of the files that the button 'record' writes, no ending")
      ->type_name("NAME")
      ->capture_default_str();
  app.add_option("--frames", o.frames, "folder for pictures (headless)")->type_name("FOLDER");
  app.add_option("--fps", o.frames_per_second, "pictures a second of the simulation")
      ->check(cli::within(0.1, 1000.0))
      ->capture_default_str();
  return device;
}

void add_picture_options(CLI::App& app, RunOptions& o) {
  app.add_option("--width", o.picture.width, "of window and pictures, pixels")
      ->check(cli::within(320, 7680))
      ->capture_default_str();
  app.add_option("--height", o.picture.height, "pixels")
      ->check(cli::within(240, 4320))
      ->capture_default_str();
  app.add_option("--scale", o.picture.scale,
                 "of type and panels, lowered to what the window has room for; 0 = as the display asks")
      ->check(cli::within(0.0, 4.0));
  app.add_option("--eye", o.picture.eye,
                 "six: azimuth and elevation (degrees) and distance (m) of the eye, x y z that it looks at")
      ->expected(6);
  app.add_flag("!--no-panels", o.picture.panels, "pictures of the room alone");
  app.add_option("--stall-graphics", o.stall_graphics_ms,
                 "ms that the graphic loop stands still, once a second")
      ->check(cli::within(0.0, 10000.0))
      ->group("");  // hidden from --help, since it serves tests only
}

std::unique_ptr<room::Device> make_device(const RunOptions& o, room::Script& script) {
  switch (o.device) {
    case room::DeviceKind::mouse:
      return nullptr;  // null lets the haptic loop make a mouse device
    case room::DeviceKind::script:
      if (o.script.empty()) throw cli::UserError("--device script needs --script FILE");
      return std::make_unique<room::PlayedHand>("script", std::move(script.hand), script.lost_at,
                                                script.back_at);
    case room::DeviceKind::file:
      if (o.motion.empty()) throw cli::UserError("--device file needs --motion FILE");
      return std::make_unique<room::PlayedHand>("file", room::read_hand_file(o.motion, o.loop.measures));
    case room::DeviceKind::udp:
      return std::make_unique<room::UdpDevice>(o.udp_port);
  }
  return nullptr;
}

int run(RunOptions options) {
  room::Script script;
  if (!options.script.empty()) {
    script = room::read_script(options.script, options.loop.measures);
    options.loop.settings = script.settings;
    options.loop.changes = script.changes;
    options.picture.title = script.title;
    if (options.seconds == 0.0 && options.headless) options.seconds = script.seconds;
  }
  if (options.tour &&
      (options.headless || !options.script.empty() || options.device != room::DeviceKind::mouse))
    throw cli::UserError(
        "--tour is of the window and the mouse: leave out --headless, --script and --device");
  // Opens the window on the scene that compares friction models, unless options choose something else.
  if (options.script.empty() && options.device == room::DeviceKind::mouse && !options.headless)
    options.loop.settings = room::comparison();
  options.loop.forces_csv = options.csv;
  room::HapticLoop loop(options.loop, make_device(options, script));
  if (!options.headless) {
#if BRISTLE_ROOM_SCREEN
    const int code = room::show_window(options, loop);
    loop.finish_recording();
    return code;
#else
    throw cli::UserError("this build has no window; run with --headless");
#endif
  }
  room::DrawFrame draw;
  if (!options.frames.empty()) {
#if BRISTLE_ROOM_SCREEN
    draw = room::draw_into(options);
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
  app.formatter(std::make_shared<cli::HelpText>());
  RunOptions options;
  const CLI::Option* device = add_options(app, options);
  add_picture_options(app, options);
  try {
    app.parse(argc, argv);
  } catch (const CLI::Success& asked) {  // thrown for --help and --version
    return app.exit(asked);
  } catch (const CLI::ParseError& error) {
    std::fprintf(stderr, "bristle-room: %s (see bristle-room --help)\n",
                 cli::complaint_of(app, error).c_str());
    return 2;
  }
  // Chooses the device that the options --script or --motion imply if --device is not given.
  if (device->count() == 0 && !options.script.empty()) options.device = room::DeviceKind::script;
  if (device->count() == 0 && !options.motion.empty()) options.device = room::DeviceKind::file;
  try {
    return run(options);
  } catch (const std::exception& e) {
    std::fprintf(stderr, "bristle-room: %s\n", e.what());
    return 2;
  }
}
