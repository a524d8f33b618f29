// Shows the room in a window of the library GLFW, with the mouse as a hand, and keys.
#define GLFW_INCLUDE_NONE  // epoxy declares OpenGL instead of GLFW
#include <GLFW/glfw3.h>
#include <backends/imgui_impl_glfw.h>
#include <epoxy/gl.h>
#include <fmt/chrono.h>
#include <fmt/format.h>
#include <imgui.h>

#include <algorithm>
#include <chrono>
#include <ctime>
#include <deque>
#include <filesystem>
#include <memory>
#include <string>
#include <system_error>
#include <thread>
#include <utility>
#include <vector>

#include "tools/libraries/files/output_file.hpp"
#include "tools/libraries/files/user_error.hpp"
#include "tools/libraries/reports/numbers.hpp"
#include "tools/products/virtual_room/compared.hpp"
#include "tools/products/virtual_room/mouse_control.hpp"
#include "tools/products/virtual_room/offscreen.hpp"
#include "tools/products/virtual_room/presets.hpp"
#include "tools/products/virtual_room/quantity_text.hpp"
#include "tools/products/virtual_room/room_view.hpp"
#include "tools/products/virtual_room/run.hpp"
#include "tools/products/virtual_room/script.hpp"
#include "tools/products/virtual_room/slow_pull.hpp"

namespace room {

namespace {

using Clock = std::chrono::steady_clock;

// Distance in simulated time, s, between the states that are kept for looking back, and how long they are
// kept, s.
constexpr double kept_every_s = 0.05, kept_s = 60.0;
constexpr double period_s = 1.0 / 60;  // shortest time from one picture to the next, s
constexpr double notice_lasts_s = 4.0;
constexpr double answer_takes_s = 1.0;  // limit of the time from sending settings until they are in force, s

std::string last_glfw_error;

[[noreturn]] void complain(const std::string& what) {
  std::string why = last_glfw_error.empty() ? "" : " (" + last_glfw_error + ")";
  throw cli::UserError("no window: " + what + why + "; --headless runs the same room without one");
}

// Owner of the GLFW library: starts it, and terminates it when destroyed.
struct Glfw {
  Glfw() {
    glfwSetErrorCallback([](int, const char* text) { last_glfw_error = text; });
    if (!glfwInit()) complain("there is no display");
  }
  ~Glfw() { glfwTerminate(); }
  Glfw(const Glfw&) = delete;
  Glfw& operator=(const Glfw&) = delete;
};

struct DestroyWindow {
  void operator()(GLFWwindow* window) const { glfwDestroyWindow(window); }
};

// Owner of ImGui's backend for GLFW, which needs an ImGui context.
struct ImGuiOnGlfw {
  explicit ImGuiOnGlfw(GLFWwindow* window) { ImGui_ImplGlfw_InitForOpenGL(window, true); }
  ~ImGuiOnGlfw() { ImGui_ImplGlfw_Shutdown(); }
  ImGuiOnGlfw(const ImGuiOnGlfw&) = delete;
  ImGuiOnGlfw& operator=(const ImGuiOnGlfw&) = delete;
};

// Guard that starts the haptic loop and stops it, however the function ends.
struct RunningLoop {
  HapticLoop& loop;
  explicit RunningLoop(HapticLoop& l) : loop(l) { loop.start(); }
  ~RunningLoop() { loop.stop(); }
  RunningLoop(const RunningLoop&) = delete;
  RunningLoop& operator=(const RunningLoop&) = delete;
};

// Returns a new file's name, with date and time, in the working folder.
std::string dated_name(const char* ending) {
  const std::string stem = fmt::format("bristle-room-{:%Y%m%d-%H%M%S}", fmt::localtime(std::time(nullptr)));
  std::string name = stem + ending;
  for (int i = 2; std::filesystem::exists(name); ++i) name = fmt::format("{}-{}{}", stem, i, ending);
  return name;
}

class RoomWindow {
 public:
  RoomWindow(const RunOptions& options, HapticLoop& loop)
      : options_(options), exchange_(loop.exchange()), window_(open(options)) {
    glfwMakeContextCurrent(window_.get());
    if (epoxy_gl_version() < 33) complain("OpenGL 3.3 is needed, and this is older");
    glfwSwapInterval(1);
    glfwSetWindowUserPointer(window_.get(), this);
    glfwSetKeyCallback(window_.get(), [](GLFWwindow* w, int key, int, int action, int mods) {
      if (action == GLFW_PRESS) static_cast<RoomWindow*>(glfwGetWindowUserPointer(w))->press(key, mods);
    });
    glfwSetScrollCallback(window_.get(), [](GLFWwindow* w, double, double notches) {
      static_cast<RoomWindow*>(glfwGetWindowUserPointer(w))->wheel(notches);
    });
    glfwSetDropCallback(window_.get(), [](GLFWwindow* w, int count, const char** paths) {
      if (count > 0) static_cast<RoomWindow*>(glfwGetWindowUserPointer(w))->load_settings(paths[0]);
    });
    view_ = std::make_unique<RoomView>(options.loop.measures, sensible_samples(), content_scale());
    imgui_ = std::make_unique<ImGuiOnGlfw>(window_.get());
    view_->gui.settings = view_->gui.beginning = options.loop.settings;
    if (options.tour) begin_tour();
  }

  void run() {
    auto last = Clock::now();
    while (!glfwWindowShouldClose(window_.get())) {
      const auto begin = Clock::now();
      const double elapsed = std::chrono::duration<double>(begin - last).count();
      last = begin;
      take_news();
      if (options_.seconds > 0 && room().time >= options_.seconds) break;
      draw(std::min(elapsed, 0.25));
      stall();
      const double used = std::chrono::duration<double>(Clock::now() - begin).count();
      if (used < period_s) {
        glfwWaitEventsTimeout(period_s - used);
      } else {
        glfwPollEvents();
      }
    }
    take_news();
  }

  const Snapshot& room() const { return exchange_.room.latest(); }
  long pictures() const { return pictures_; }

 private:
  static GLFWwindow* open(const RunOptions& options) {
    glfwWindowHint(GLFW_CONTEXT_VERSION_MAJOR, 3);
    glfwWindowHint(GLFW_CONTEXT_VERSION_MINOR, 3);
    glfwWindowHint(GLFW_OPENGL_PROFILE, GLFW_OPENGL_CORE_PROFILE);
    glfwWindowHint(GLFW_SCALE_TO_MONITOR, GLFW_TRUE);
    GLFWwindow* window =
        glfwCreateWindow(options.picture.width, options.picture.height, "bristle room", nullptr, nullptr);
    if (!window) complain("OpenGL 3.3 is not available");
    glfwSetWindowSizeLimits(window, 640, 480, GLFW_DONT_CARE, GLFW_DONT_CARE);
    return window;
  }

  float content_scale() const {
    float x = 1, y = 1;
    glfwGetWindowContentScale(window_.get(), &x, &y);
    if (options_.picture.scale > 0) x = static_cast<float>(options_.picture.scale);
    int width = 0, height = 0;
    glfwGetFramebufferSize(window_.get(), &width, &height);
    return fitting_scale(x, width, height);
  }

  void take_news() {
    exchange_.room.refresh();
    for (PlotPoint point; exchange_.plot.pop(point);) view_->add(point);
    keep_for_later();
  }

  // Keeps states of the room of the last minute, to which the user can look back in a pause.
  void keep_for_later() {
    if (room().paused) return;
    view_->gui.back_s = 0;
    if (!past_.empty() && room().time < past_.back().time) past_.clear();
    if (!past_.empty() && room().time < past_.back().time + kept_every_s) return;
    past_.push_back(room());
    if (past_.back().time - past_.front().time > kept_s) past_.pop_front();
  }

  // Returns the present state of the room or, in a pause, the past state that the user looks at.
  const Snapshot& shown() {
    GuiState& gui = view_->gui;
    gui.back_most_s =
        room().paused && !past_.empty() ? static_cast<float>(room().time - past_.front().time) : 0;
    if (gui.back_most_s <= 0 || !(gui.back_s > 0)) return room();
    const double wanted = room().time - static_cast<double>(gui.back_s);
    const auto later = std::lower_bound(past_.begin(), past_.end(), wanted,
                                        [](const Snapshot& kept, double t) { return kept.time < t; });
    shown_ = later == past_.end() ? past_.back() : *later;
    shown_.paused = true;
    shown_.loop = room().loop;
    return shown_;
  }

  // Measures, once for each picture, the speed of the simulation and the rate of pictures.
  void measure() {
    const double now = glfwGetTime();
    ++pictures_counted_;
    if (const double lasted = now - counted_at_; lasted >= 1.0) {
      const bool runs = !room().paused && !was_paused_ && room().time > simulated_;
      view_->gui.share = runs ? std::min((room().time - simulated_) / (lasted * room().speed), 1.0) : 1.0;
      view_->gui.pictures = static_cast<double>(pictures_counted_) / lasted;
      counted_at_ = now;
      simulated_ = room().time;
      was_paused_ = room().paused;
      pictures_counted_ = 0;
    }
  }

  void begin_tour() {
    Settings to = settings_of(Comparison::none);
    to.presliding_length = 4e-3;  // mean bend at a snap, m: so long that one sees the bristles bend
    change_settings(to);
    act(Act::tour);
    touring_ = tour_begins_ = touched_ = true;
  }

  // Ends the tour (a guided demonstration) and its hand; a comparing scene that has begun goes on.
  void end_tour() {
    if (std::exchange(touring_, false) && view_->gui.settings.compare == Comparison::none) act(Act::reset);
  }

  // Shows the tour's present line of text (the tour is a guided demonstration). Once the tour's hand has
  // finished, starts the scene that compares models.
  void follow_tour() {
    view_->title.clear();
    if (!touring_) return;
    const bool compares = view_->gui.settings.compare == Comparison::models;
    // Stays true until the room's time shows that the reset at the tour's beginning has happened.
    tour_begins_ = tour_begins_ && room().time > 1.0;
    const double t = (tour_begins_ ? 0.0 : room().time) + (compares ? tour_hand_s : 0.0);
    if (!compares && t >= tour_hand_s) {
      compare(Comparison::models);
      notice_until_ = 0;  // the tour's own line says what the scene shows
      touring_ = tour_begins_ = true;
      return;
    }
    if (t >= tour_s) {
      touring_ = false;
      say("the hand is yours: push the brush's block");
    } else {
      view_->title = tour_says(t);
    }
  }

  void say(const std::string& text) {
    view_->notice = text;
    notice_until_ = glfwGetTime() + notice_lasts_s;
  }

  void draw(double elapsed) {
    int width = 0, height = 0;
    glfwGetFramebufferSize(window_.get(), &width, &height);
    if (width < 16 || height < 16 || glfwGetWindowAttrib(window_.get(), GLFW_ICONIFIED)) return;
    view_->set_scale(content_scale());
    follow_mouse(width);
    follow_keys(elapsed * room().speed);
    if (glfwGetTime() > notice_until_) view_->notice.clear();
    if (glfwGetTime() > sent_at_ + answer_takes_s) view_->follow(room().settings);
    follow_tour();
    if (!touched_ && options_.device == DeviceKind::mouse) {
      view_->notice =
          static_cast<float>(width) < 1000 * content_scale()
              ? "drag: push    arrow keys: push slowly    L: slow pull    F1: help"
              : "drag: push with the tool, with Shift finely    arrow keys: push slowly    L: slow pull    "
                "right drag: turn the view    F1: help";
    }
    ImGui_ImplGlfw_NewFrame();
    // Tells ImGui also of keys that were pressed and released again between two slow pictures.
    for (const int key : pressed_) ImGui::GetIO().KeysDown[key] = true;
    const Wishes wishes = view_->draw(shown(), width, height, static_cast<float>(elapsed), 0);
    for (const int key : pressed_) ImGui::GetIO().KeysDown[key] = is_down(key);
    pressed_.clear();
    ++pictures_;
    obey(wishes);
    if (screenshot_) take_screenshot(width, height);
    glfwSwapBuffers(window_.get());
    measure();
  }

  void obey(const Wishes& wishes) {
    if (wishes.settings) {
      touring_ = false;  // ends the tour, which would replace the user's settings
      send_settings();
    }
    if (wishes.key != 0) obey_key(wishes.key, 0);
    if (wishes.scene) compare(*wishes.scene);
    if (wishes.list_files) list_files();
    if (!wishes.load.empty()) load_settings(wishes.load.c_str());
    for (int k = 0; wishes.full_speed && k < 8; ++k) act(Act::faster);
  }

  void send_settings() {
    exchange_.settings.write(view_->gui.settings);
    sent_at_ = glfwGetTime();
  }

  void act(Act what) {
    exchange_.acts.push(what);
    if (what == Act::reset && mouse_.hand().turns) mouse_.let_go();
    const bool begins_anew = what == Act::reset || what == Act::record || what == Act::replay ||
                             what == Act::slow_pull || what == Act::tour;
    if (begins_anew) {
      view_->forget();
      past_.clear();
      touring_ = false;
    }
    touched_ = touched_ || what == Act::slow_pull;
  }

  void write_file(const std::string& name, const std::string& text, const char* says = "written: ") {
    try {
      cli::OutputFile(name).write(text);
      say(says + name);
    } catch (const cli::UserError& error) {
      say(error.what());
    }
  }

  void export_plots() {
    std::string text = "t,displacement,friction,applied\n";
    const History& h = view_->history();
    for (std::size_t i = 0; i < h.size(); ++i)
      text += fmt::format("{:.6g},{:.9g},{:.6g},{:.6g}\n", h[i].time, h[i].displacement, -h[i].friction,
                          h[i].applied);
    write_file(dated_name(".csv"), text);
  }

  void save_settings() {
    const std::string name = dated_name(".toml");
    write_file(dated_name("-material.toml"), "[material]\n" + material_as_toml(view_->gui.settings));
    write_file(name,
               "# Settings of the room, without where the block is and how its bristles bend.\n[settings]\n" +
                   settings_as_toml(view_->gui.settings),
               "settings, not where the block is, written: ");
  }

  // Lists the files that the button Load offers, the newest first.
  void list_files() {
    std::vector<std::pair<std::filesystem::file_time_type, std::string>> found;
    std::error_code error;
    for (const auto& entry : std::filesystem::directory_iterator(".", error)) {
      if (entry.path().extension() == ".toml")
        found.emplace_back(entry.last_write_time(error), entry.path().filename());
    }
    std::sort(found.rbegin(), found.rend());
    constexpr std::size_t most = 16;
    view_->gui.files.clear();
    for (std::size_t i = 0; i < std::min(found.size(), most); ++i)
      view_->gui.files.push_back(found[i].second);
  }

  void load_settings(const char* path) {
    try {
      const Settings now = view_->gui.settings;
      const Settings loaded = read_script(path, view_->measures(), now).settings;
      change_settings(loaded);
      if (loaded.compare != now.compare) act(Act::reset);
      say(std::string("settings of ") + path);
    } catch (const std::exception& error) {
      say(error.what());
    }
  }

  // Starts from its beginning a scene that compares blocks, or the level floor with one block.
  void compare(Comparison scene) {
    change_settings(settings_of(scene));
    act(Act::reset);
    say(scene_of(scene).says);
  }
  void compare_next() {
    const auto next = static_cast<std::size_t>(view_->gui.settings.compare) + 1;
    compare(static_cast<Comparison>(next % compared_scenes.size()));
  }

  void change_settings(const Settings& to) {
    view_->gui.undo.note(view_->gui.settings, true, false);
    view_->gui.settings = to;
    send_settings();
  }

  void take_screenshot(int width, int height) {
    screenshot_ = false;
    const std::string name = dated_name(".png");
    try {
      glBindFramebuffer(GL_READ_FRAMEBUFFER, 0);
      glReadBuffer(GL_BACK);
      write_png(name, read_pixels(width, height));
      say("screenshot: " + name);
    } catch (const cli::UserError& error) {
      say(error.what());
    }
  }

  // Stops the graphic loop for a while, if a test asks for it (RunOptions::stall_graphics_ms).
  void stall() {
    if (options_.stall_graphics_ms <= 0 || glfwGetTime() < next_stall_) return;
    std::this_thread::sleep_for(std::chrono::duration<double, std::milli>(options_.stall_graphics_ms));
    next_stall_ = glfwGetTime() + 1.0;
  }

  void follow_mouse(int framebuffer_width) {
    double x = 0, y = 0;
    int width = 1, height = 1;
    glfwGetCursorPos(window_.get(), &x, &y);
    glfwGetWindowSize(window_.get(), &width, &height);
    const double density = static_cast<double>(framebuffer_width) / std::max(width, 1);
    MouseButtons buttons;
    if (!ImGui::GetIO().WantCaptureMouse || mouse_.busy()) {
      buttons.left = glfwGetMouseButton(window_.get(), GLFW_MOUSE_BUTTON_LEFT) == GLFW_PRESS;
      buttons.right = glfwGetMouseButton(window_.get(), GLFW_MOUSE_BUTTON_RIGHT) == GLFW_PRESS;
      buttons.middle = glfwGetMouseButton(window_.get(), GLFW_MOUSE_BUTTON_MIDDLE) == GLFW_PRESS;
    }
    buttons.fine = is_down(GLFW_KEY_LEFT_SHIFT) || is_down(GLFW_KEY_RIGHT_SHIFT);
    mouse_.move(static_cast<float>(x * density), static_cast<float>(y * density), buttons,
                view_->layout().picture.scene, view_->camera, room(), view_->measures());
    send_hand();
  }

  bool is_down(int key) const { return glfwGetKey(window_.get(), key) == GLFW_PRESS; }

  // Returns whether the panels get the keys: from the key Tab on, until Esc or a click.
  static bool keys_are_of_panels() {
    return (ImGui::GetIO().ConfigFlags & ImGuiConfigFlags_NavEnableKeyboard) != 0;
  }
  static void give_keys_to_panels(bool given) {
    ImGuiIO& io = ImGui::GetIO();
    if (given == keys_are_of_panels()) return;
    io.ConfigFlags ^= ImGuiConfigFlags_NavEnableKeyboard;
    ImGui::SetWindowFocus(given ? "settings" : nullptr);
  }

  void follow_keys(double elapsed) {
    if (ImGui::IsMouseClicked(ImGuiMouseButton_Left)) give_keys_to_panels(false);
    if (keys_are_of_panels() || ImGui::GetIO().WantTextInput || options_.device != DeviceKind::mouse) return;
    const int right = is_down(GLFW_KEY_RIGHT) - is_down(GLFW_KEY_LEFT);
    const int away = is_down(GLFW_KEY_UP) - is_down(GLFW_KEY_DOWN);
    const bool fine = is_down(GLFW_KEY_LEFT_SHIFT) || is_down(GLFW_KEY_RIGHT_SHIFT);
    mouse_.push(right, away, fine, elapsed, room(), view_->measures());
    const int left = is_down(GLFW_KEY_Q) - is_down(GLFW_KEY_W);
    const double torque = mouse_.turn(left, fine, elapsed, room());
    if (mouse_.hand().turns)
      say(fmt::format("the hand turns the block with {:.0f} N mm; Esc lets go", 1e3 * torque));
    send_hand();
  }

  void send_hand() {
    if (!mouse_.hand_changed()) return;
    touched_ = true;
    end_tour();  // a user who touches the room takes over from the tour
    exchange_.mouse.write(mouse_.hand());
  }

  void wheel(double notches) {
    if (ImGui::GetIO().WantCaptureMouse) return;
    const bool control = is_down(GLFW_KEY_LEFT_CONTROL) || is_down(GLFW_KEY_RIGHT_CONTROL);
    const std::string what =
        mouse_.turn_wheel(static_cast<float>(notches), control, view_->camera, view_->measures());
    if (!what.empty()) say(what);
  }

  void press(int key, int mods) {
    if (key >= 0 && key <= GLFW_KEY_LAST && pressed_.size() < 64) pressed_.push_back(key);
    if (key == GLFW_KEY_TAB) return give_keys_to_panels(true);
    if (key == GLFW_KEY_ESCAPE) give_keys_to_panels(false);
    if (ImGui::GetIO().WantTextInput || (keys_are_of_panels() && key == GLFW_KEY_SPACE)) return;
    obey_key(key, mods);
  }

  void obey_key(int key, int mods) {
    const auto choose = [&](FrictionModel model) {
      Settings to = view_->gui.settings;
      to.model = model;
      change_settings(to);
    };
    switch (key) {
      case GLFW_KEY_SPACE:
        return act(room().paused ? Act::run : Act::pause);
      case GLFW_KEY_PERIOD:
        return act(Act::single_step);
      case GLFW_KEY_R:
        return act(Act::reset);
      case GLFW_KEY_C:
        return act(room().recording ? Act::stop_recording : Act::record);
      case GLFW_KEY_P:
        return act(Act::replay);
      case GLFW_KEY_1:
        return choose(FrictionModel::brush);
      case GLFW_KEY_2:
        return choose(FrictionModel::lugre);
      case GLFW_KEY_3:
        return choose(FrictionModel::coulomb);
      case GLFW_KEY_L:
        return act(Act::slow_pull);
      case GLFW_KEY_T:
        return begin_tour();
      case GLFW_KEY_LEFT_BRACKET:
      case GLFW_KEY_RIGHT_BRACKET:
        if (room().paused)
          view_->gui.back_s = std::clamp(view_->gui.back_s + (key == GLFW_KEY_LEFT_BRACKET ? 0.1f : -0.1f),
                                         0.0f, view_->gui.back_most_s);
        return;
      case GLFW_KEY_MINUS:
        return act(Act::slower);
      case GLFW_KEY_EQUAL:
        return act(Act::faster);
      case GLFW_KEY_ESCAPE:
        view_->help_shown = false;
        end_tour();
        return mouse_.let_go();
      case GLFW_KEY_F1:
        view_->help_shown = !view_->help_shown;
        return;
      case GLFW_KEY_K:
        return compare_next();
      case GLFW_KEY_A:
        view_->by_age = !view_->colours_by_age(room());
        return;
      case GLFW_KEY_E:
        return export_plots();
      case GLFW_KEY_S:
        return save_settings();
      case GLFW_KEY_Z:
        if ((mods & GLFW_MOD_CONTROL) && view_->gui.undo.undo(view_->gui.settings)) send_settings();
        return;
      case GLFW_KEY_F12:
        screenshot_ = true;
        return;
      case GLFW_KEY_G:
        view_->glass_shown = !view_->glass_shown;
        return;
      case GLFW_KEY_H:
        view_->panels = !view_->panels;
        return;
      case GLFW_KEY_V:
        view_->camera = Camera{};
        return;
      case GLFW_KEY_Q:
        if (mods & GLFW_MOD_CONTROL) glfwSetWindowShouldClose(window_.get(), GLFW_TRUE);
        return;
      default:
        return;
    }
  }

  RunOptions options_;
  Exchange& exchange_;
  Glfw glfw_;
  std::unique_ptr<GLFWwindow, DestroyWindow> window_;
  std::unique_ptr<RoomView> view_;
  std::unique_ptr<ImGuiOnGlfw> imgui_;
  MouseControl mouse_;
  bool screenshot_ = false, touched_ = false;
  double notice_until_ = 0, next_stall_ = 1.0;
  double sent_at_ = 0;  // time when settings were last sent, s; 0: only the initial ones
  long pictures_ = 0;
  // Real and simulated time, s, at which the speeds were last computed.
  double counted_at_ = 0, simulated_ = 0;
  bool was_paused_ = false, touring_ = false, tour_begins_ = false;
  long pictures_counted_ = 0;
  std::vector<int> pressed_;  // keys pressed since the last picture was drawn
  std::deque<Snapshot> past_;
  Snapshot shown_;
};

void print_summary(const Snapshot& room, long pictures) {
  const LoopStatistics& l = room.loop;
  fmt::print(
      "bristle-room: {:.1f} s, {} ticks, {} pictures; late ticks: {} by this program, {} by the machine\n",
      room.time, cli::count_text(l.ticks), cli::count_text(static_cast<std::uint64_t>(pictures)), l.late_ours,
      l.late_machine);
  fmt::print("bristle-room: a tick computes {} (p50), {} (p99), {} (max); period {}, {}, {}\n",
             with_unit(l.p50, "s"), with_unit(l.p99, "s"), with_unit(l.max, "s"),
             with_unit(l.period_p50, "s"), with_unit(l.period_p99, "s"), with_unit(l.period_max, "s"));
  fmt::print("bristle-room: the block lies at {:.1f}, {:.1f}, {:.1f} mm\n", 1e3 * room.block_position[0],
             1e3 * room.block_position[1], 1e3 * room.block_position[2]);
}

}  // namespace

int show_window(const RunOptions& options, HapticLoop& loop) {
  leave_cores_to_the_haptic_loop();
  RoomWindow window(options, loop);
  {
    const RunningLoop running(loop);
    window.run();
  }
  print_summary(window.room(), window.pictures());
  return 0;
}

}  // namespace room
