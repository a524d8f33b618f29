// Runs the haptic loop. With the real clock it has two threads: the haptic thread ticks; the desk beside it
// does what needs memory, files or time (materials, patches, scripts, recordings), and hands over each result
// as an Order. With the virtual clock the caller's thread does both in turn, so that everything happens at
// the same tick in every run.
#include "tools/products/virtual_room/haptic_loop.hpp"

#include <algorithm>
#include <array>
#include <atomic>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <cstring>
#include <deque>
#include <filesystem>
#include <thread>
#include <utility>

#include <fmt/format.h>
#include <sys/prctl.h>

#include <bristle/bristle.hpp>

#include "bench/paced_loop.hpp"
#include "tools/libraries/files/user_error.hpp"
#include "tools/products/virtual_room/compared.hpp"
#include "tools/products/virtual_room/hand_motion.hpp"
#include "tools/products/virtual_room/mouse_device.hpp"
#include "tools/products/virtual_room/parameters.hpp"
#include "tools/products/virtual_room/recorder.hpp"
#include "tools/products/virtual_room/script.hpp"
#include "tools/products/virtual_room/slow_pull.hpp"
#include "tools/products/virtual_room/world.hpp"

namespace room {
namespace {

constexpr double fade_time = 0.05;      // time over which the force on the hand fades in and out, s
constexpr double message_time = 6.0;    // time for which a message to the user is shown, s
constexpr double farthest_hand = 10.0;  // limit of the hand's coordinates on each axis, m
constexpr double strongest_hand = 1e3;  // limit of the hand's force on each axis, N

// Deadline, s, so long that no tick misses it. With it the monitor only measures the periods between ticks,
// and need not look for the cause of a late tick.
constexpr double no_deadline = 3600.0;  // s
constexpr auto desk_pause = std::chrono::milliseconds(2);
// Speeds of slow motion, each given as the share of ticks that step the world.
constexpr double speeds[] = {1.0, 0.3, 0.1, 0.03, 0.01};
constexpr std::size_t speed_count = sizeof speeds / sizeof speeds[0];
constexpr std::uint64_t ticks_between_statistics = 64, ticks_between_bristles = 16;

enum class Recording : unsigned char { as_it_is, begin, end };

/// Order from the desk (the thread that may allocate) to the haptic thread, which reads it in place. The desk
/// waits until it is carried out.
struct Order {
  bool has_parameters = false;
  std::array<Parameters, 1 + most_compared> parameters;  ///< parameters of each block
  std::uint64_t revision = 0;
  bool reset = false;
  Device* device = nullptr;  ///< new device; null: no change of device
  Recording recording = Recording::as_it_is;
  std::string message;
};

Hand within_reach(const Hand& hand, bool& sane) {
  Hand h = hand;
  for (int i = 0; i < 3; ++i) {
    sane = sane && std::isfinite(h.position[i]) && std::isfinite(h.force[i]) && std::isfinite(h.angle);
    h.position[i] = std::clamp(h.position[i], -farthest_hand, farthest_hand);
    h.force[i] = std::clamp(h.force[i], -strongest_hand, strongest_hand);
  }
  return h;
}

// Returns a file name similar to the wanted one that no earlier recording has, so that none is overwritten.
std::string free_name(const std::string& wanted) {
  const auto taken = [](const std::string& base) {
    for (const char* ending : {".csv", ".hand.csv", ".toml"}) {
      if (std::filesystem::is_regular_file(base + ending)) return true;
    }
    return false;
  };
  std::string name = wanted;
  for (int k = 2; taken(name); ++k) name = fmt::format("{}-{}", wanted, k);
  return name;
}

}  // namespace

struct HapticLoop::Impl {
  /// A block in a room of its own: the first block, or one that is compared with it and stepped only while it
  /// is shown.
  struct Block {
    explicit Block(const RoomMeasures& measures)
        : batch(bristle::BatchOptions{}.with_threads(1)), world(measures, batch), maker(batch) {
      batch.warm_up();
    }
    void begin_figures() noexcept {
      moved.begin();
      strength.begin();
    }
    void note_figures(Comparison scene, double time) noexcept {
      moved.take(time, world.block_position().x());
      strength.take(scene, time, world.friction().x());
    }
    void show_figures(Comparison scene, Figures& to) const noexcept {
      to = {moved.metres(), strength.newton(), strength.beside(scene)};
    }

    bristle::PatchBatch batch;
    World world;
    PatchMaker maker;
    Moved moved;
    Strength strength;
    bool has_patches = false;  // whether `world` uses the patches of `maker`; only the desk reads this
  };
  using Blocks = std::array<std::unique_ptr<Block>, 1 + most_compared>;
  static Blocks make_blocks(const RoomMeasures& measures) {
    Blocks made;
    for (auto& block : made) block = std::make_unique<Block>(measures);
    return made;
  }

  Impl(const LoopOptions& given, std::unique_ptr<Device> given_device)
      : options(given),
        dt(1.0 / given.rate_hz),
        blocks(make_blocks(given.measures)),
        world(blocks[0]->world),
        own_device(std::move(given_device)),
        computing(dt),
        ending(dt),
        period(no_deadline) {
    if (!(given.rate_hz >= 1000.0 && given.rate_hz <= 10000.0))
      throw cli::UserError(fmt::format("rate {:g} Hz; allowed: 1000 to 10000 Hz", given.rate_hz));
    if (!own_device) own_device = std::make_unique<MouseDevice>(exchange);
    device = own_device.get();
    changes.assign(given.changes.begin(), given.changes.end());
    const Order first = parameters_order(given.settings, true);
    blocks[0]->batch.warm_up();
    take_parameters(first);
    revision = revisions = 0;
    reset_worlds();
    remember(first.message.c_str());
    if (!given.forces_csv.empty()) recorder.start_forces(given.forces_csv);
    recording = recorder.is_open();
  }

  // Functions of the haptic thread.

  void tick(double due_s) noexcept {
    const double begin = bristle::DeadlineMonitor::wall_now(), cpu = bristle::DeadlineMonitor::cpu_now();
    take_order();
    take_acts();
    const bool stepping = paused ? steps_wanted > 0 : is_due(due_s);
    if (stepping) {
      if (paused) --steps_wanted;
      step();
      exchange.plot.push(plot_point(bristle::DeadlineMonitor::wall_now() - begin));
    } else if (paused) {
      stand_still();
    } else {
      wait_slowly();
    }
    publish();
    const double end = bristle::DeadlineMonitor::wall_now();
    const double own = bristle::DeadlineMonitor::cpu_now() - cpu;
    if (stepping) computing.record(end - begin, own);
    ending.record(end - (due_s > 0.0 ? due_s : begin), own);
    if (due_s > 0.0 && last_begin > 0.0) period.record(begin - last_begin, own);
    last_begin = begin;
    if (++ticks % ticks_between_statistics == 1) refresh_statistics();
  }

  void step() noexcept {
    Hand now = hand;
    bool there = device->read(world.time(), now);
    now = within_reach(now, there);
    // Keeps the hand's end of the spring where it is once the hand lets go, whatever position the device
    // reports. Otherwise the fading force could jump.
    if (!now.holds) std::copy(hand.position, hand.position + 3, now.position);
    if (there) hand = now;
    note_device(there);
    device_seen = device_seen || there;
    // Fades the spring of a hand that lets go, and all forces of a lost device, so that neither ends with a
    // jump. A force beside the spring (the mouse's press) does not fade on letting go, because the device
    // ends it.
    const double change = dt / fade_time;
    presence = std::clamp(presence + (there ? change : -change), 0.0, 1.0);
    grip = std::clamp(grip + (there && hand.holds ? change : -change), 0.0, 1.0);
    Hand felt = hand;
    felt.holds = grip > 0.0;
    for (double& force : felt.force) force *= presence;
    felt.turns = there && hand.turns;
    record(felt, there);
    world.step(dt, felt, grip, device->limits().force);
    step_beside();
    if (!world.is_sound()) {
      remember("the block left the room: put back");
      requests.push(Act::reset);
      // Stops a recording of the hand here, where the clock restarts, without waiting for the desk (the
      // thread that writes the file).
      if (hand_recorded) recording = hand_recorded = false;
      reset_worlds();
    }
    // Fades the force on the hand in after a pause, so that it does not jump. The world feels it in full at
    // once.
    feedback = std::min(1.0, feedback + change);
    double force[3];
    for (int i = 0; i < 3; ++i) force[i] = feedback * world.device_force()[i];
    device->write(force);
    std::copy(force, force + 3, last_force);
    simulated.store(world.time(), std::memory_order_release);
  }

  void take_parameters(const Order& order) noexcept {
    const bool begins = order.parameters[0].settings.compare != world.settings().compare;
    for (std::size_t i = 0; i < blocks.size(); ++i) blocks[i]->world.take(order.parameters[i]);
    // Resets the worlds for a new scene. Bristles that were bent in the old one would push its block.
    if (begins) reset_worlds();
  }

  void reset_worlds() noexcept {
    for (const auto& block : blocks) {
      block->world.reset();
      block->begin_figures();
    }
  }

  std::size_t compared() const noexcept { return scene_of(world.settings().compare).beside; }

  void step_beside() noexcept {
    const Comparison scene = world.settings().compare;
    const double time = world.time();
    if (world.applied().norm() > 0.0 || hand.turns)
      for (const auto& block : blocks) block->moved.begin(time);
    blocks[0]->note_figures(scene, time);
    Hand nobody;
    nobody.holds = false;
    for (std::size_t i = 1; i <= compared(); ++i) {
      World& other = blocks[i]->world;
      other.step(dt, nobody, 0.0, 1.0);
      if (!other.is_sound()) other.reset();
      blocks[i]->note_figures(scene, time);
    }
  }

  void show_blocks(Snapshot& s) const noexcept {
    const Comparison scene = world.settings().compare;
    world.show(s);
    blocks[0]->show_figures(scene, s);
    s.compared = compared();
    for (std::size_t i = 0; i < s.compared; ++i) {
      const Block& other = *blocks[i + 1];
      other.world.show_pose(s.beside[i].position, s.beside[i].orientation);
      s.beside[i].model = other.world.settings().model;
      other.show_figures(scene, s.beside[i]);
    }
  }

  // Returns whether this tick steps the world. In slow motion most ticks only wait; with the virtual clock
  // every tick steps.
  bool is_due(double due_s) noexcept {
    if (speed == 0 || due_s <= 0.0) return true;
    progress += speeds[speed];
    if (progress < 1.0) return false;
    progress -= 1.0;
    return true;
  }
  // Serves the device in a tick of slow motion in which the world stands still: sends the last force again,
  // because a silent device would count as lost.
  void wait_slowly() noexcept {
    Hand unused = hand;
    device->read(world.time(), unused);
    device->write(last_force);
  }

  // Runs a tick while the room pauses. Reads the device and ignores what it says, so that its packets do not
  // pile up.
  void stand_still() noexcept {
    Hand unused;
    device->read(world.time(), unused);
    release_device();
  }

  // Sends the device a force of zero when no force is computed: in a pause, before a change of device, and at
  // the end.
  void release_device() noexcept {
    device->write({0.0, 0.0, 0.0});
    std::fill(last_force, last_force + 3, 0.0);
    feedback = 0.0;
  }

  void note_device(bool there) noexcept {
    if (there == device_there) return;
    device_there = there;
    char line[sizeof message];
    const char* what = there         ? "is there"
                       : device_seen ? "lost: its force fades to zero"
                                     : "is not there yet";
    std::snprintf(line, sizeof line, "device %s %s", device->name(), what);
    remember(line);
  }

  void take_order() noexcept {
    const Order* const given = given_order.load(std::memory_order_acquire);
    if (given == nullptr) return;
    const Order& order = *given;
    if (order.has_parameters) {
      take_parameters(order);
      revision = order.revision;
    }
    if (order.device) {
      release_device();
      device = order.device;
      device_there = true;
      device_seen = false;
    }
    if (order.reset) {
      reset_worlds();
      grip = 0.0;
      presence = 1.0;
      simulated.store(0.0, std::memory_order_release);
    }
    if (order.recording != Recording::as_it_is)
      recording = hand_recorded = order.recording == Recording::begin;
    remember(order.message.c_str());
    given_order.store(nullptr, std::memory_order_release);
  }

  void take_acts() noexcept {
    Act act = Act::none;
    while (exchange.acts.pop(act)) {
      switch (act) {
        case Act::none:
          break;
        case Act::pause:
          paused = true;
          break;
        case Act::run:
          paused = false;
          break;
        case Act::single_step:
          paused = true;
          ++steps_wanted;
          break;
        case Act::slower:
          if (speed + 1 < speed_count) ++speed;
          break;
        case Act::faster:
          if (speed > 0) --speed;
          break;
        case Act::reset:
        case Act::record:
        case Act::stop_recording:
        case Act::replay:
        case Act::slow_pull:
        case Act::tour:
          requests.push(act);
          break;
      }
    }
  }

  void record(const Hand& felt, bool there) noexcept {
    if (!recording) return;
    row.time = world.time();
    row.dt = dt;
    row.hand = felt;
    row.hand.holds = hand.holds;
    row.device_there = there;
    row.revision = revision;
    row_waits = true;
  }
  // Completes the row begun for the recording with the forces of the step, and sends it to be written.
  void finish_row() noexcept {
    if (!row_waits) return;
    row.patches = world.patch_forces(row.patch);
    recorder.push(row);
    row_waits = false;
  }

  PlotPoint plot_point(double step_time) noexcept {
    finish_row();
    PlotPoint p;
    world.plot(p);
    p.step_time = static_cast<float>(step_time);
    for (std::size_t i = 0; i < compared(); ++i) {
      PlotPoint other;
      blocks[i + 1]->world.plot(other);
      p.beside_displacement[i] = other.displacement;
      p.beside_friction[i] = other.friction;
    }
    return p;
  }

  void publish() noexcept {
    if (ticks % ticks_between_bristles == 0) world.show_bristles(bristles);
    Snapshot& s = exchange.room.draft();
    show_blocks(s);
    s.tick = ticks;
    s.paused = paused;
    s.recording = recording;
    s.speed = speeds[speed];
    s.held = grip > 0.0;
    for (int i = 0; i < 3; ++i) s.device[i] = s.held ? hand.position[i] : s.tool[i];
    s.device_lost = !device_there;
    s.bristles = bristles;
    const bool stands = !device_there || message_left > 0;
    if (message_left > 0) --message_left;
    std::memcpy(s.message, message, sizeof s.message);
    if (!stands) s.message[0] = '\0';
    s.loop = statistics;
    exchange.room.publish();
  }

  void remember(const char* line) noexcept {
    if (!line[0]) return;
    std::snprintf(message, sizeof message, "%s", line);
    message_left = static_cast<long>(message_time / dt);
  }

  void refresh_statistics() noexcept {
    statistics = {ticks,           ending.misses_ours(), ending.misses_machine(), dt,
                  computing.p50(), computing.p99(),      computing.max(),         period.p50(),
                  period.p99(),    period.max()};
  }

  void run() noexcept {
    prctl(PR_SET_TIMERSLACK, 1UL);
    bristle_bench::PacedLoop pace(dt);
    last_begin = 0.0;
    while (running.load(std::memory_order_acquire)) {
      pace.wait();
      tick(pace.due_s());
    }
    release_device();
  }

  // Functions of the desk, the thread that may allocate.

  bool order_waits() const noexcept { return given_order.load(std::memory_order_acquire) != nullptr; }

  // Hands over an order. None may be waiting.
  void give(Order order) {
    own_order = std::move(order);
    given_order.store(&own_order, std::memory_order_release);
  }
  void say(const std::string& line) {
    Order order;
    order.message = line;
    give(std::move(order));
  }

  Order parameters_order(const Settings& wanted, bool anew) {
    Order order;
    Block& first = *blocks[0];
    order.parameters[0] = first.maker.make(wanted, anew);
    order.has_parameters = true;
    settings = order.parameters[0].settings;
    for (std::size_t i = 0; i < most_compared; ++i)
      order.parameters[i + 1] = beside_parameters(*blocks[i + 1], order.parameters[0], i, anew);
    order.revision = ++revisions;
    order.message = first.maker.message();
    recorder.know(revisions, settings);
    return order;
  }

  // Makes the parameters of compared block number i. Only a block with a brush gets patches, in a batch of
  // its own.
  Parameters beside_parameters(Block& other, const Parameters& main, std::size_t i, bool anew) {
    Parameters p = main;
    p.settings = settings_beside(main.settings, i);
    p.settings.pad_radius = 0.0;
    p.pad = nullptr;
    p.patches = {};
    p.new_patches = anew;
    if (i >= scene_of(main.settings.compare).beside || p.settings.model != FrictionModel::brush) {
      other.has_patches = false;
      return p;
    }
    p = other.maker.make(p.settings, anew || !other.has_patches);
    other.has_patches = true;
    return p;
  }

  // Frees the objects that the last order replaced. Call it after the haptic thread has taken that order,
  // because it may use them until then.
  void clear_up() {
    for (const auto& block : blocks) block->maker.remove_old();
    leaving_device.reset();
    if (closing) close_recording();
    if (failed) {
      failed = false;
      Order order;
      order.recording = Recording::end;
      order.message = failure;
      give(std::move(order));
    }
  }

  void close_recording() {
    closing = false;
    try {
      recorder.drain();
      const std::uint64_t rows = recorder.rows_written(), lost = recorder.lost();
      recorder.finish();
      say(lost == 0 ? fmt::format("recorded {} ticks", rows)
                    : fmt::format("recorded {} ticks; {} were lost: the disk is slow", rows, lost));
    } catch (const cli::UserError& error) {
      give_up_recording(error.what());
    }
  }

  // Stops recording when the disk is full, while the loop goes on. The room shows the failure at once;
  // finish_recording() reports it later.
  void give_up_recording(const char* why) {
    recorder.abandon();
    closing = false;
    failed = true;
    failure = why;
  }

  void desk() {
    try {
      if (recorder.is_open()) recorder.drain();
    } catch (const cli::UserError& error) {
      give_up_recording(error.what());
    }
    if (order_waits()) return;
    clear_up();
    if (order_waits()) return;
    if (waiting == Act::none && exchange.settings.refresh()) {
      // Gives the order for new settings before it handles requests, because these may rely on the settings.
      give(parameters_order(exchange.settings.latest(), false));
    } else if (waiting != Act::none || requests.pop(waiting)) {
      // Closes a recording of the hand before any request that restarts the simulated time, since rows of two
      // times would spoil the file. A recording of forces alone continues.
      const bool spoils =
          waiting == Act::record ? recorder.is_open() : waiting != Act::stop_recording && recorder.has_hand();
      const Act act = std::exchange(waiting, spoils ? waiting : Act::none);
      serve(spoils ? Act::stop_recording : act);
    } else if (!changes.empty() && simulated.load(std::memory_order_acquire) >= changes.front().t) {
      give(parameters_order(changes.front().settings, false));
      changes.pop_front();
    } else if (replay_device && simulated.load(std::memory_order_acquire) >= replay_end) {
      end_replay();
    }
  }

  void serve(Act act) {
    Order order;
    try {
      switch (act) {
        case Act::reset:
          order = replay_device && !pulling ? begin_replay() : begin_anew();
          break;
        case Act::record:
          // Opens the files before it makes patches. If a file cannot be opened, no order with new patches
          // must be dropped.
          recorded = free_name(options.record_to);
          recorder.start_all(recorded, settings, revisions + 1);
          order = begin_anew();
          order.recording = Recording::begin;
          order.message = fmt::format("recording to {}.csv", recorded);
          break;
        case Act::stop_recording:
          order.recording = Recording::end;
          closing = recorder.is_open();
          break;
        case Act::replay:
          order = begin_replay();
          break;
        case Act::slow_pull:
          order = begin_own_hand("slow pull", &slow_pull);
          order.message = fmt::format("slow pull: the peak of {:.2f} N comes after about two seconds",
                                      order.parameters[0].peak_coefficient * load_at_rest(settings));
          break;
        case Act::tour:
          order = begin_own_hand("tour", &tour_hand);
          break;
        default:
          return;
      }
    } catch (const std::exception& error) {  // drops the request if a file cannot be read or written
      if (act == Act::record) recorder.abandon();
      order = {};
      order.message = error.what();
    }
    give(std::move(order));
  }

  Order begin_anew() {
    Order order = parameters_order(settings, true);
    order.reset = true;
    if (pulling) end_hand(order);
    if (!replay_device) changes.assign(options.changes.begin(), options.changes.end());
    return order;
  }

  // Makes an order that resets the block and lets the program's own hand move it, with these settings.
  Order begin_own_hand(const char* name, HandMotion (*motion)(const Settings&, double, const RoomMeasures&)) {
    Order order = parameters_order(settings, true);
    order.reset = true;
    HandMotion of_room = motion(settings, order.parameters[0].peak_coefficient, options.measures);
    replay_end = of_room.end();
    begin_hand(order, name, std::move(of_room));
    pulling = true;
    changes.clear();
    return order;
  }

  void begin_hand(Order& order, const char* name, HandMotion motion) {
    leaving_device = std::move(replay_device);
    replay_device = std::make_unique<PlayedHand>(name, std::move(motion));
    order.device = replay_device.get();
  }
  void end_hand(Order& order) {
    leaving_device = std::move(replay_device);
    order.device = own_device.get();
    pulling = false;
  }

  Order begin_replay() {
    const std::string& name = recorded.empty() ? options.record_to : recorded;
    Script script = read_script(name + ".toml", options.measures);
    if (!replay_device || pulling) settings_before_replay = settings;
    pulling = false;
    Order order = parameters_order(script.settings, true);
    order.reset = true;
    begin_hand(order, "replay", std::move(script.hand));
    replay_end = script.seconds;
    changes.assign(script.changes.begin(), script.changes.end());
    order.message = fmt::format("replay of {}.toml, {:.3g} s", name, replay_end);
    return order;
  }

  void end_replay() {
    const bool own = pulling;
    Order order = own ? Order{} : parameters_order(settings_before_replay, false);
    end_hand(order);
    order.message = own ? "the hand is yours" : "replay has ended";
    // Continues the script that ran before a replay, at the present time: its changes up to now are applied
    // at once.
    if (!own) changes.assign(options.changes.begin(), options.changes.end());
    give(std::move(order));
  }

  void run_desk() {
    while (running.load(std::memory_order_acquire)) {
      try {
        desk();
      } catch (const std::exception& error) {  // drops the request if memory runs out
        std::fprintf(stderr, "bristle-room: %s\n", error.what());
      }
      std::this_thread::sleep_for(desk_pause);
    }
  }

  LoopOptions options;
  double dt;
  Exchange exchange;
  Blocks blocks;
  World& world;  // that of the first block

  std::unique_ptr<Device> own_device, replay_device, leaving_device;

  // Members that only the haptic thread reads and writes, without a lock.
  Device* device = nullptr;
  Hand hand;
  bool device_there = true, device_seen = false, paused = false, row_waits = false;
  // Whether a recording is in progress, and whether it includes the hand (hand_recorded) and not only forces.
  bool recording = false, hand_recorded = false;
  double grip = 0.0, presence = 1.0, last_begin = 0.0;
  double feedback = 1.0;  // share of the computed force sent to the device
  double last_force[3] = {0, 0, 0};
  std::size_t speed = 0;  // index in `speeds` (of slow motion) of the present speed
  double progress = 0.0;  // slow motion: sum of speeds since the last step; at 1, steps
  std::uint64_t ticks = 0, revision = 0;
  long steps_wanted = 0, message_left = 0;
  char message[sizeof Snapshot{}.message] = {};
  BristleView bristles;
  RecordRow row;
  bristle::DeadlineMonitor computing, ending, period;
  LoopStatistics statistics;

  // Members that the haptic thread and the desk share; they are safe without a lock.
  std::atomic<const Order*> given_order{nullptr};
  SpscRing<Act, 64> requests;
  std::atomic<double> simulated{0.0};
  std::atomic<bool> running{false};
  Recorder recorder;

  // Members that only the desk reads and writes, which is the thread that allocates and reads files.
  Order own_order;
  std::uint64_t revisions = 0;
  Settings settings, settings_before_replay;
  std::deque<Change> changes;
  double replay_end = 0.0;
  bool pulling = false;     // whether the replayed motion is the room's own slow pull
  std::string recorded;     // file name of the last recording
  Act waiting = Act::none;  // user's request that waits for a recording to be closed

  // closing: the recording must be closed. failed: it has failed, and the user has not been told yet.
  bool closing = false, failed = false;
  std::string failure;  // error text of a recording that failed

  std::thread haptic_thread, desk_thread;
};

HapticLoop::HapticLoop(const LoopOptions& options, std::unique_ptr<Device> device)
    : impl_(std::make_unique<Impl>(options, std::move(device))) {}

HapticLoop::~HapticLoop() { stop(); }

void HapticLoop::start() {
  if (impl_->running.exchange(true)) return;
  impl_->haptic_thread = std::thread([this] { impl_->run(); });
  impl_->desk_thread = std::thread([this] { impl_->run_desk(); });
}

void HapticLoop::stop() {
  if (!impl_->running.exchange(false)) return;
  impl_->haptic_thread.join();
  impl_->desk_thread.join();
}

void HapticLoop::advance(std::uint64_t ticks) {
  for (std::uint64_t k = 0; k < ticks; ++k) {
    impl_->desk();
    impl_->tick(0.0);
  }
}

void HapticLoop::finish_recording() {
  impl_->recorder.finish();
  if (!impl_->failure.empty()) throw cli::UserError(impl_->failure);
}
Exchange& HapticLoop::exchange() noexcept { return impl_->exchange; }
double HapticLoop::rate_hz() const noexcept { return impl_->options.rate_hz; }
LoopStatistics HapticLoop::statistics() const noexcept {
  impl_->refresh_statistics();
  return impl_->statistics;
}
std::uint64_t HapticLoop::state_hash() const noexcept { return impl_->world.state_hash(); }

}  // namespace room
