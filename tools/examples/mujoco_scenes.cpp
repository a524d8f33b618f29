#include "tools/examples/mujoco_scenes.hpp"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <stdexcept>

#include <fmt/format.h>

#include "tools/examples/mujoco_friction.hpp"

namespace mujoco_example {

namespace {

constexpr double pi = 3.14159265358979323846;

std::string gravity_on_slope(double degrees) {
  const double angle = degrees * pi / 180.0;
  return fmt::format(R"(gravity="{:.17g} 0 {:.17g}")", 9.81 * std::sin(angle), -9.81 * std::cos(angle));
}

/// Returns the text of a model with the options with which MuJoCo's own friction holds best: elliptic cones,
/// and friction ten times as stiff as the normal force. `gravity`: attribute, or empty for MuJoCo's own;
/// `contacts`: attributes of all geoms, besides the friction coefficient; `more`: further sections.
std::string model(const std::string& gravity, double coefficient, const std::string& contacts,
                  const std::string& bodies, const std::string& more = "") {
  return fmt::format(R"(<mujoco><option timestep="0.002" cone="elliptic" impratio="10" {}/>
<default><geom {} friction="{} 0.005 0.0001"/></default>
<worldbody>{}
</worldbody>{}</mujoco>)",
                     gravity, contacts, coefficient, bodies, more);
}
constexpr const char* solref_10ms = R"(solref="0.01 1")";

/// Returns the text of a finger, a geom on a slide along an axis.
std::string finger(const char* name, const char* position, const char* axis, const char* geom) {
  return fmt::format(R"(
  <body pos="{}"><joint name="{}" type="slide" axis="{}" damping="20"/><geom {}/></body>)",
                     position, name, axis, geom);
}

/// Actuators of two fingers.
constexpr const char* two_motors = R"(
<actuator><motor joint="left"/><motor joint="right"/></actuator>)";

constexpr const char* ground = R"(<geom type="plane" size="5 5 1"/>)";

/// Returns the text of a free box at a position, with half edges (m) and mass (kg).
std::string box(const std::string& name, const std::string& position, const std::string& half, double mass) {
  return fmt::format(R"(
  <body name="{}" pos="{}"><freejoint/><geom type="box" size="{}" mass="{}"/></body>)",
                     name, position, half, mass);
}

constexpr std::array<double, 3> along_x = {1.0, 0.0, 0.0};

/// Returns the force and torque that act on the observed body from outside.
double* force_on_body(const mjModel& model, mjData& data) {
  return data.xfrc_applied + 6 * mj_name2id(&model, mjOBJ_BODY, "body");
}

bristle::Coefficients law() {
  return bristle::Coefficients{}
      .with_kinetic(0.7)
      .with_peak(0.8)
      .with_presliding_length(20e-6)
      .with_damping_per_newton(0.5);
}

double heading(const mjtNum* quaternion) {
  return std::atan2(2.0 * (quaternion[0] * quaternion[3] + quaternion[1] * quaternion[2]),
                    1.0 - 2.0 * (quaternion[2] * quaternion[2] + quaternion[3] * quaternion[3]));
}

/// One scene with one kind of friction; runs it and records the observed body.
class Stepper {
 public:
  Stepper(const Scene& scene, Friction kind)
      : scene_(scene),
        model_(load(scene.xml)),
        data_(make_data(*model_)),
        body_(mj_name2id(model_.get(), mjOBJ_BODY, "body")) {
    if (body_ < 0) throw std::runtime_error("scene " + scene.name + ": no body called \"body\"");
    if (kind == Friction::noslip) model_->opt.noslip_iterations = 10;
    if (kind == Friction::bristle) {
      const ContactDims dims = remove_friction(*model_);
      FrictionOptions options;
      options.patch.with_max_normal_load(60.0);
      friction_ = std::make_unique<BristleFriction>(*model_, dims, law(), options);
    }
    mj_forward(model_.get(), data_.get());
    find_position(start_);
  }

  int step() {
    scene_.drive(*model_, *data_);
    if (friction_) {
      friction_->step(*model_, *data_);
    } else {
      mj_step(model_.get(), data_.get());
    }
    return data_->ncon;
  }
  void sample() {
    Sample now{
        data_->time, 0.0, heading(data_->qpos + model_->jnt_qposadr[model_->body_jntadr[body_]] + 3), {}};
    mj_kinematics(model_.get(), data_.get());
    find_position(now.position);
    for (int a = 0; a < 3; ++a) {
      now.position[a] -= start_[a];
      now.travel += scene_.direction[static_cast<std::size_t>(a)] * now.position[a];
    }
    if (scene_.radial)
      now.travel = std::hypot(now.position[0] + start_[0], now.position[1] + start_[1]) - start_[0];
    result.samples.push_back(now);
  }
  double time_step() const { return model_->opt.timestep; }
  static double creep(const std::vector<Sample>& samples) {
    const Sample &end = samples.back(), &from = samples[samples.size() * 3 / 4 - 1];
    return (end.travel - from.travel) / (end.t - from.t);
  }

  Run result;

 private:
  void find_position(double (&position)[3]) const {
    mju_mulMatVec(position, data_->xmat + 9 * body_, scene_.point, 3, 3);
    for (int a = 0; a < 3; ++a) position[a] += data_->xpos[3 * body_ + a];
  }

  const Scene& scene_;
  Model model_;
  Data data_;
  int body_;
  std::unique_ptr<BristleFriction> friction_;
  double start_[3] = {};
};

}  // namespace

const char* to_string(Friction friction) {
  switch (friction) {
    case Friction::stock:
      return "MuJoCo";
    case Friction::noslip:
      return "MuJoCo, noslip";
    default:
      return "bristle";
  }
}

Model load(const std::string& xml) {
  const auto files = std::make_unique<mjVFS>();
  mj_defaultVFS(files.get());
#if mjVERSION_HEADER < 313
  mj_makeEmptyFileVFS(files.get(), "scene.xml", static_cast<int>(xml.size()));
  std::memcpy(files->filedata[0], xml.data(), xml.size());
#else
  mj_addBufferVFS(files.get(), "scene.xml", xml.data(), static_cast<int>(xml.size()));
#endif
  char error[1000] = "";
  Model model(mj_loadXML("scene.xml", files.get(), error, sizeof error), mj_deleteModel);
  mj_deleteVFS(files.get());
  if (!model) throw std::runtime_error(std::string("MuJoCo refuses the scene: ") + error);
  return model;
}

Data make_data(const mjModel& model) { return {mj_makeData(&model), mj_deleteData}; }

Scene pinch(double grip_n, double swing_n, const char* solref) {
  const bool swings = swing_n != 0.0;
  constexpr const char* pad = R"(type="box" size="0.02 0.02 0.02" mass="0.1")";
  return {.name = swings ? "pinch_swing" : fmt::format("pinch_{:g}N", grip_n),
          .title = swings ? fmt::format("pinch of {:g} to {:g} N", grip_n - swing_n, grip_n + swing_n)
                          : fmt::format("pinch of {:g} N, solref {}", grip_n, solref),
          .xml = model(
              "", 0.7, fmt::format("solref=\"{}\"", solref),
              finger("left", "0 -0.0301 0", "0 1 0", pad) + finger("right", "0 0.0301 0", "0 -1 0", pad) + R"(
  <body name="body"><freejoint/><geom type="capsule" size="0.01 0.012" mass="0.045"/></body>)",
              two_motors),
          .drive = [=](const mjModel&, mjData& data) {
            data.ctrl[0] = data.ctrl[1] = grip_n + swing_n * std::sin(2.0 * pi * data.time);
          }};
}

Scene tapped_block() {
  return {
      .name = "tapped_block",
      .title = "block on a slope, tapped",
      .xml = model(gravity_on_slope(15.0), 0.5, "", ground + box("body", "0 0 0.02", "0.05 0.05 0.02", 0.2)),
      .direction = along_x,
      .drive = [](const mjModel& model, mjData& data) {
        const bool tap = data.time < 2.0 && std::fmod(data.time, 0.2) < 0.01;
        force_on_body(model, data)[1] = tap ? 0.3 : 0.0;   // N, aside
        force_on_body(model, data)[2] = tap ? -1.0 : 0.0;  // force into the slope, N
      }};
}

Scene spun_box(double speed) {
  Scene scene = pushed_box();
  scene.name = "spun_box";
  scene.title = "box turning on the spot";
  scene.drive = [speed](const mjModel&, mjData& data) {
    if (data.time == 0.0) data.qvel[5] = speed;
  };
  return scene;
}

Scene pushed_box() {
  return {.name = "pushed_box",
          .title = "box pushed off centre",
          .xml = model("", 0.4, solref_10ms, ground + box("body", "0 0 0.01", "0.1 0.1 0.01", 0.5)),
          .seconds = 2.0,
          .direction = along_x,
          .drive = [](const mjModel& model, mjData& data) {
            const double push = data.time >= 0.1 && data.time < 0.3 ? 4.0 : 0.0;
            force_on_body(model, data)[0] = push;
            // Adds the torque of the push, which acts at y = 0.1 m, N m.
            force_on_body(model, data)[5] = -0.1 * push;
          }};
}

Scene ten_blocks() {
  std::string blocks;
  for (int i = 0; i < 10; ++i)
    blocks += box(i == 0 ? "body" : fmt::format("body{}", i), fmt::format("0 {} 0.02", 0.15 * i),
                  "0.05 0.05 0.02", 0.2);
  return {.name = "ten_blocks",
          .title = "ten blocks on a slope",
          .xml = model(gravity_on_slope(15.0), 0.5, "", ground + blocks),
          .seconds = 2.0,
          .direction = along_x};
}

Scene tower(double push_n, double ramp_s) {
  std::string plates;
  for (int i = 0; i < 10; ++i)
    plates += box(i == 4 ? "body" : fmt::format("body{}", i), fmt::format("0 0 {}", 0.01 + 0.02 * i),
                  fmt::format("{0} {0} 0.01", 0.1 - 0.003 * i), 0.2);
  return {.name = push_n == 0.0   ? "tower"
                  : ramp_s == 0.0 ? "pushed_tower"
                                  : "pressed_tower",
          .title = fmt::format("tower of ten plates, the fifth pushed with {:g} N", push_n),
          .xml = model("", 0.5, solref_10ms, ground + plates),
          .direction = along_x,
          .drive = [=](const mjModel& model, mjData& data) {
            const double since = data.time - tower_push_begin_s;
            const double rise = ramp_s > 0.0 ? std::min(since / ramp_s, 1.0) : 1.0;
            const bool pushed = since >= 0.0 && since < ramp_s + tower_push_s;
            force_on_body(model, data)[0] = pushed ? rise * push_n : 0.0;
          }};
}

Scene mesh_on_slope(bool on_mesh) {
  const auto mesh = [](const char* name, double x, double y, double z) {
    std::string all;
    for (int i = 0; i < 8; ++i)
      all += fmt::format("{} {} {} ", i & 1 ? x : -x, i & 2 ? y : -y, i & 4 ? z : -z);
    return fmt::format(R"(<mesh name="{}" vertex="{}"/>)", name, all);
  };
  return {.name = on_mesh ? "mesh_on_mesh" : "mesh_on_plane",
          .title = fmt::format("box of a mesh on a slope of 10 degrees, a {}", on_mesh ? "mesh" : "plane"),
          .xml = model(gravity_on_slope(10.0), 0.5, solref_10ms,
                       std::string(on_mesh ? R"(<geom type="mesh" mesh="slab" pos="0 0 -0.1"/>)" : ground) +
                           R"(<body name="body" pos="0 0 0.02"><freejoint/>
    <geom type="mesh" mesh="box" mass="0.2"/></body>)",
                       R"(<option><flag multiccd="enable"/></option><asset>)" +
                           mesh("box", 0.05, 0.05, 0.02) + mesh("slab", 1.0, 1.0, 0.1) + "</asset>"),
          .direction = along_x};
}

Scene equal_tower() {
  Scene scene = tower();
  scene.name = "equal_tower";
  scene.title = "tower of ten equal plates";
  for (int i = 1; i < 10; ++i) {
    const std::string size = fmt::format("size=\"{0} {0} 0.01\"", 0.1 - 0.003 * i);
    scene.xml.replace(scene.xml.find(size), size.size(), "size=\"0.1 0.1 0.01\"");
  }
  return scene;
}

Scene turntable(double seconds) {
  return {.name = "turntable",
          .title = "box on a turntable of 1.5 rad/s, 1 m off its axis",
          .xml = model("", 0.6, solref_10ms,
                       R"(
  <body><joint type="hinge" axis="0 0 1"/><geom type="box" size="1.5 1.5 0.05" mass="1e4"/></body>)" +
                           box("body", "1 0 0.07", "0.05 0.05 0.02", 0.5)),
          .seconds = seconds,
          .radial = true,
          .drive = [](const mjModel&, mjData& data) { data.qvel[0] = std::min(data.qvel[0] + 1e-3, 1.5); }};
}

Scene held_off_centre(double grip_n) {
  constexpr double mass = 0.2;
  constexpr const char* tip = R"(type="sphere" size="0.008" mass="0.1")";
  return {.name = "held_off_centre",
          .title = fmt::format("box held 20 mm off its centre with {:g} N, shaken", grip_n),
          .xml = model(R"(gravity="-9.81 0 0")", 0.7, R"(solref="0.005 1" condim="4")",
                       finger("left", "0 -0.02 -0.0181", "0 0 1", tip) +
                           finger("right", "0 -0.02 0.0181", "0 0 -1", tip) +
                           box("body", "0 0 0", "0.03 0.04 0.01", mass),
                       two_motors),
          .seconds = 60.0,
          .direction = {-1.0, 0.0, 0.0},
          .point = {0.0, -0.02, 0.0},
          // Simulates in the frame of the shaken hand. There the shaking is an inertial force, which is added
          // to the weight.
          .drive = [=](const mjModel& model, mjData& data) {
            data.ctrl[0] = data.ctrl[1] = grip_n;
            double* force = force_on_body(model, data);
            force[0] = -mass * 10.0 * std::sin(2.0 * pi * 3.0 * data.time);
            force[1] = -mass * 5.0 * std::sin(2.0 * pi * 2.0 * data.time);
          }};
}

Scene fingertips(bool shaken) {
  constexpr const char* tip = R"(type="sphere" size="0.008" mass="0.05")";
  constexpr double rate = 2.0 * pi * 3.0;
  const double reach = shaken ? 10.0 / (rate * rate) : 0.0;
  return {
      .name = shaken ? "shaken_hand" : "fingertips",
      .title = shaken ? "box held by three fingertips, the hand is shaken" : "box held by three fingertips",
      .xml = model(R"(gravity="-9.81 0 0")", 0.7, R"(solref="0.005 1")",
                   R"(
  <body><joint name="hand" type="slide" axis="1 0 0"/>
    <geom type="box" size="0.02 0.02 0.02" pos="0.15 0 0" mass="1" contype="0" conaffinity="0"/>)" +
                       finger("thumb", "0 0 -0.0281", "0 0 1", tip) +
                       finger("left", "0 0.02 0.0281", "0 0 -1", tip) +
                       finger("right", "0 -0.02 0.0281", "0 0 -1", tip) + "</body>" +
                       box("body", "0 0 0", "0.03 0.04 0.02", 0.2),
                   R"(
<actuator>
  <motor joint="thumb"/><motor joint="left"/><motor joint="right"/>
  <position joint="hand" kp="20000"/><velocity joint="hand" kv="400"/>
</actuator>)"),
      .direction = {-1.0, 0.0, 0.0},
      .drive = [reach](const mjModel&, mjData& data) {
        const double since = std::max(data.time - 0.25, 0.0);  // time since the fingers closed, s
        data.ctrl[0] = 12.0;
        data.ctrl[1] = data.ctrl[2] = 6.0;
        data.ctrl[3] = reach * std::sin(rate * since);
        data.ctrl[4] = reach * rate * (since > 0.0 ? std::cos(rate * since) : 0.0);
      }};
}

Scene pushed_book() {
  constexpr double mass = 0.8;
  return {.name = "pushed_book",
          .title = "book on a table, pushed stop and go",
          .xml = model("", book_coefficient, solref_10ms,
                       ground + box("body", "0 0 0.01", "0.1 0.13 0.01", mass)),
          .direction = along_x,
          .drive = [](const mjModel& model, mjData& data) {
            const double in_second = data.time - std::floor(data.time) - 0.2;
            const bool go = data.time < 3.0 && in_second >= -1e-9 && in_second < book_go_s - 1e-9;
            force_on_body(model, data)[0] = (go ? book_go : book_stop) * book_coefficient * mass * 9.81;
          }};
}

std::vector<Scene> all_scenes() {
  return {pinch(5.9, 0.0, "0.02 1"),
          pinch(12.0),
          pinch(30.0),
          pinch(60.0),
          pinch(36.0, 24.0),
          tapped_block(),
          pushed_box(),
          ten_blocks(),
          tower(),
          tower(3.0),
          tower(3.0, 1.0),
          equal_tower(),
          mesh_on_slope(false),
          mesh_on_slope(true),
          turntable(60.0),
          pushed_book(),
          fingertips(false),
          fingertips(true),
          held_off_centre()};
}

std::vector<Run> run(const Scene& scene, const std::vector<Friction>& kinds, double sample_s) {
  return bristle_example::run_scene<Stepper>(scene, kinds, sample_s);
}

}  // namespace mujoco_example
