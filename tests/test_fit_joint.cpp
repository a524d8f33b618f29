// `bristle fit --joint`: finds parameters from logs of invented joints.
#include <catch2/catch.hpp>

#include <algorithm>
#include <cmath>
#include <random>
#include <string>
#include <vector>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "command_line.hpp"
#include "expect.hpp"
#include "made_up_joint.hpp"
#include "tools/libraries/files/user_error.hpp"
#include "tools/libraries/fitting/data.hpp"

namespace bristle_test::test_fit_joint {

using namespace bristle;
using cli::JointEstimate;
using cli::JointFit;
using cli::JointLog;

namespace {

const JointEstimate& number_of(const JointFit& fit, const std::string& name) {
  return *std::find_if(fit.numbers.begin(), fit.numbers.end(),
                       [&](const JointEstimate& e) { return e.name == name; });
}

/// Returns the log of a joint that swings at `hertz` (10 s at 500 Hz): inertia, friction of a base and a
/// viscous part, gravity; noise of 20 mN m on the motor's torque.
cli::JointLog swing(double inertia, double base, double viscous, double hertz, double gravity) {
  std::mt19937 random(7);
  std::normal_distribution<double> noise(0.0, 0.02);
  cli::JointLog log;
  log.name = "swing";
  log.has_speed = true;
  log.has_outside = gravity > 0.0;
  const double w = 2.0 * M_PI * hertz;
  for (int i = 0; i < 5000; ++i) {
    const double t = 0.002 * i, q = 0.5 * std::sin(w * t), speed = 0.5 * w * std::cos(w * t);
    const double outside = -gravity * std::sin(q);
    log.t.push_back(t);
    log.angle.push_back(q);
    log.speed.push_back(speed);
    log.outside.push_back(outside);
    log.motor.push_back(-inertia * w * w * q + std::copysign(base, speed) + viscous * speed - outside +
                        noise(random));
  }
  return log;
}

}  // namespace

TEST_CASE("A fit of a joint recovers its numbers by direction", "[fit][joints]") {
  const JointFit fit = cli::fit_joint(made_up_log(12.0));
  // The motor's torque has noise of 10 mN m, so means of ten samples have 3.2 mN m.
  CHECK(fit.fitted_rms < 0.005);
  const auto check = [&](const char* name, double expected, double tolerance) {
    const JointEstimate& e = number_of(fit, name);
    INFO(name << " " << e.value << " (" << e.low << " to " << e.high << ")");
    CHECK(e.determined);
    CHECK(std::abs(e.value / expected - 1.0) < tolerance);
    CHECK(e.low < expected);
    CHECK(e.high > expected);
  };
  check("inertia", made_up_inertia, 0.002);
  check("viscous", 0.08, 0.02);
  check("base", 0.3, 0.02);
  check("motor driving", 0.08, 0.04);
  check("motor driven", 0.25, 0.02);
  check("stiffness", 200.0, 0.02);
}

TEST_CASE("A fit by a joint's own derivatives ends where one by differences does, in a quarter of the runs",
          "[fit][joints]") {
  const JointLog log = made_up_log(3.0);
  const JointFit own = cli::fit_joint(log), by_differences = cli::fit_joint(log, {}, true);
  CHECK(own.fitted_rms < 1.01 * by_differences.fitted_rms);
  CHECK(4 * own.runs < by_differences.runs);
}

TEST_CASE(
    "On a log of a joint with losses by direction the brush is closer than Coulomb's friction and LuGre",
    "[fit][joints]") {
  const std::vector<JointFit> fits = cli::judge_joint(made_up_log(6.0), {true});
  REQUIRE(fits.size() == 8);
  CHECK(fits.back().model == "brush");
  CHECK(fits.back().judged_rms < 0.01);
  for (const JointFit& fit : fits)
    if (fit.model == "Coulomb (m1)" || fit.model == "LuGre")
      CHECK(fit.judged_rms > 2.0 * fits.back().judged_rms);
}

TEST_CASE("A fit of a joint to a part of its log does not look at the rest", "[fit][joints]") {
  const JointLog log = made_up_log(3.0);
  for (const cli::JointPart part : {cli::JointPart{true}, cli::JointPart{false, 1.5}}) {
    JointLog other = log;
    // Adds an outside torque of 0.5 N m only in the parts of the log that are not fitted to: the odd ones of
    // 24 blocks, or the second half. The two fits must be equal.
    for (std::size_t k = 0; k < log.t.size(); ++k)
      if (part.alternate ? static_cast<int>(log.t[k] * 8.0) % 2 == 1 &&
                               std::fmod(log.t[k] * 8.0, 1.0) > 0.2 && std::fmod(log.t[k] * 8.0, 1.0) < 0.8
                         : log.t[k] > 1.52)
        other.outside[k] += 0.5;
    const JointFit a = cli::fit_joint(log, part), b = cli::fit_joint(other, part);
    CHECK(b.judged_rms > a.judged_rms + 0.1);
    CHECK(b.fitted_rms == Approx(a.fitted_rms).epsilon(0.05));
  }
}

TEST_CASE("Each interval of a joint's log weighs by its time", "[fit][joints]") {
  // Adds samples on straight lines between their neighbours, which change no torque averaged over
  // time.
  const JointLog log = made_up_log(1.0);
  JointLog split = log;
  for (std::vector<double> JointLog::*column :
       {&JointLog::t, &JointLog::angle, &JointLog::speed, &JointLog::motor, &JointLog::outside}) {
    std::vector<double>& to = split.*column;
    to.clear();
    for (std::size_t k = 0; k < log.t.size(); ++k) {
      const std::vector<double>& from = log.*column;
      if (k > 0 && k % 10 < 5) to.push_back(0.5 * (from[k - 1] + from[k]));
      to.push_back(from[k]);
    }
  }
  const JointFit whole = cli::fit_joint(log), other = cli::fit_joint(split);
  CHECK(other.fitted_rms == Approx(whole.fitted_rms).epsilon(0.02));
  CHECK(number_of(other, "inertia").value == Approx(number_of(whole, "inertia").value).epsilon(0.002));
}

TEST_CASE("A joint's models are judged on what follows --fit-until", "[fit][joints]") {
  const JointLog log = made_up_log(1.0);
  std::string csv = "t,angle,speed,motor,outside\n";
  for (std::size_t k = 0; k < log.t.size(); ++k)
    csv +=
        fmt::format("{},{},{},{},{}\n", log.t[k], log.angle[k], log.speed[k], log.motor[k], log.outside[k]);
  const TemporaryFolder folder;
  const Outcome outcome =
      run_cli(folder, "fit '" + folder.write("log.csv", csv) + "' --joint --rivals --fit-until 0.6 --json -");
  REQUIRE(outcome.code == 0);
  const auto report = nlohmann::json::parse(outcome.out);
  CHECK(report.at("fit_until_s") == 0.6);
  CHECK_FALSE(report.contains("held_out_parts"));
  const JointFit same = cli::fit_joint(log, {false, 0.6});
  CHECK(report.at("models").back().at("judged_rms_nm").get<double>() ==
        Approx(same.judged_rms).epsilon(1e-6));
}

TEST_CASE("Logs of joints are read with units, currents and pendulums, and refused by name",
          "[fit][joints]") {
  std::string rows, with_heat;
  for (int i = 0; i < 60; ++i) {
    const std::string row = std::to_string(i) + ", " + std::to_string(i % 7) + ", 500";
    rows += row + "\n";
    with_heat += row + ", 25\n";
  }
  const JointLog log =
      cli::parse_joint_log("t [ms], angle [deg], current [mA]\n" + rows, "log", {}, 2.0, 3.0);
  REQUIRE(log.t.size() == 60);
  CHECK(log.t[2] == Approx(0.002));
  CHECK(log.angle[2] == Approx(2.0 * 0.017453292519943295));
  CHECK(log.motor[2] == Approx(1.0));
  CHECK(log.outside[2] == Approx(-3.0 * std::sin(log.angle[2])));
  CHECK(log.speed[7] == Approx((log.angle[8] - log.angle[6]) / 0.002));  // at a jump: angles restart at 0
  // Names and units of columns are given by the caller, for logs that other programs write.
  cli::FitReading reading;
  reading.columns = {{"t", "time"}, {"angle", "q"}, {"motor", "u"}};
  reading.units = {{"t", "ms"}, {"angle", "deg"}, {"motor", "mN m"}};
  const JointLog named = cli::parse_joint_log("time, q, u\n" + rows, "log", reading, {}, 3.0);
  CHECK(named.t == log.t);
  CHECK(named.angle == log.angle);
  CHECK(named.motor[2] == Approx(0.5));
  CHECK(names(named.understood, {"t = 'time' in ms", "angle = 'q' in deg", "motor = 'u'"}));
  const auto refusal = [&](const std::string& text, std::optional<double> constant = {},
                           const cli::FitReading& how = {}) {
    return message_of<cli::UserError>([&] { cli::parse_joint_log(text, "log", how, constant, {}); });
  };
  CHECK_THROWS_AS(cli::fit_joint(log), cli::UserError);  // 60 ms of a log are too short
  const JointLog warm = cli::parse_joint_log("t,angle,motor,temperature\n" + with_heat, "log", {}, {}, {});
  CHECK(warm.temperature.size() == warm.t.size());
  const JointLog damp = cli::parse_joint_log("t,angle,motor,humidity\n" + with_heat, "log", {}, {}, {});
  CHECK(damp.temperature.empty());
  CHECK(names(damp.understood, {"column humidity is not used"}));
  CHECK(names(refusal("t,angle\n" + rows), {"log:1", "motor", "--columns"}));
  CHECK(names(refusal("t,angle,current\n" + rows), {"--torque-constant"}));
  CHECK(names(refusal("t,angle,motor\n" + rows, 2.0), {"--torque-constant", "motor"}));
  CHECK(names(refusal("t,motor,x\n" + rows), {"angle"}));
  CHECK(names(refusal("t,angle,motor\n1,2,3\n2,3,4\n"), {"at least 50"}));
  reading.columns = {{"force", "q"}};
  CHECK(names(refusal("t,q,motor\n" + rows, {}, reading), {"'force'", "angle, speed, motor"}));
}

TEST_CASE("A share of the motor's torque cannot swallow a joint's inertia and friction", "[fit][joints]") {
  const struct {
    double inertia, base, viscous, hertz, gravity;
  } cases[] = {{0.05, 1.0, 0.1, 1.0, 0.0},
               {0.05, 1.0, 0.1, 1.0, 2.0},
               {0.01, 1.0, 0.1, 0.3, 1.0},
               {0.3, 0.65, 0.08, 0.8, 0.0}};
  for (const auto& c : cases) {
    CAPTURE(c.inertia, c.gravity);
    const cli::JointFit fit = cli::fit_joint(swing(c.inertia, c.base, c.viscous, c.hertz, c.gravity));
    CHECK(number_of(fit, "inertia").value == Approx(c.inertia).margin(0.002));
    CHECK(number_of(fit, "base").value == Approx(c.base).epsilon(0.02));
    CHECK(number_of(fit, "viscous").value == Approx(c.viscous).margin(0.01));
    for (const char* name : {"motor driving", "motor driven", "static base", "static motor driving"})
      CHECK_FALSE(number_of(fit, name).determined);
    CHECK_FALSE(fit.loaded);
    // Means of five samples have noise of 20 / sqrt(5) = 9 mN m.
    CHECK(fit.fitted_rms == Approx(0.009).epsilon(0.15));
  }
}

TEST_CASE("Dry and viscous friction of a joint that warms are told apart, at the mean temperature",
          "[fit][joints]") {
  cli::JointLog log = swing(0.05, 1.0, 0.5, 1.0, 0.0);
  const JointFit cold = cli::fit_joint(log);
  CHECK(cold.warming.empty());
  double sum = 0.0;
  for (std::size_t i = 0; i < log.t.size(); ++i) {
    const double degrees = 40.0 - 15.0 * std::exp(-log.t[i] / 4.0);
    log.temperature.push_back(degrees);
    log.motor[i] -= (degrees - 25.0) * (0.006 * std::copysign(1.0, log.speed[i]) + 0.02 * 0.5 * log.speed[i]);
    sum += degrees;
  }
  const double mean = sum / 5000.0, dry = 1.0 - 0.006 * (mean - 25.0), viscous = 1.0 - 0.02 * (mean - 25.0);
  const JointFit fit = cli::fit_joint(log);
  REQUIRE(fit.warming.size() == 2);
  for (const cli::JointEstimate& change : fit.warming) CHECK(change.determined);
  CHECK(fit.warming[0].value == Approx(-0.006 / dry).epsilon(0.05));
  CHECK(fit.warming[1].value == Approx(-0.02 / viscous).epsilon(0.05));
  CHECK(number_of(fit, "base").value == Approx(dry).epsilon(0.01));
  CHECK(number_of(fit, "viscous").value == Approx(0.5 * viscous).epsilon(0.02));
  CHECK(number_of(fit, "inertia").value == Approx(0.05).margin(0.002));
  CHECK(fit.fitted_rms == Approx(cold.fitted_rms).epsilon(0.05));
}

TEST_CASE("A long log of a joint is fitted by pieces of it", "[fit][joints]") {
  cli::JointLog log = swing(0.05, 1.0, 0.1, 1.0, 0.0);
  log.temperature = log.t;
  const cli::JointLog pieces = cli::pieces_of(log, 2400);
  CHECK(pieces.t.size() == 2400);
  CHECK(pieces.temperature.size() == 2400);
  REQUIRE(pieces.parts.size() == 23);
  CHECK(pieces.t.front() == log.t.front());
  CHECK(pieces.t.back() == log.t.back());
  for (const std::size_t part : pieces.parts) CHECK(pieces.t[part] - pieces.t[part - 1] > 0.1);
  const JointFit fit = cli::fit_joint(pieces);
  CHECK(number_of(fit, "base").value == Approx(1.0).epsilon(0.01));
  CHECK(number_of(fit, "inertia").value == Approx(0.05).margin(0.002));
  CHECK(cli::pieces_of(log, 5000).parts.empty());
}

TEST_CASE("Play of a joint is seen where it is, and not in a spring", "[fit][joints]") {
  cli::JointLog log = swing(0.05, 1.0, 0.1, 1.0, 0.0), spring = log;
  double turned = 0.0, bent = 0.02;
  for (std::size_t i = 1; i < log.t.size(); ++i) {
    if (log.speed[i] * log.speed[i - 1] < 0.0) turned = log.angle[i];
    // Friction is absent for 0.03 rad after each reversal; a spring bends by 0.02 rad to either side.
    if (std::abs(turned) > 0.0 && std::abs(log.angle[i] - turned) < 0.03)
      log.motor[i] -= std::copysign(1.0, log.speed[i]);
    bent = std::clamp(bent + spring.angle[i] - spring.angle[i - 1], -0.02, 0.02);
    spring.motor[i] += 50.0 * bent - std::copysign(1.0, spring.speed[i]);
  }
  CHECK(cli::joint_play(log, 0.05) == Approx(0.03).epsilon(0.3));
  CHECK(cli::joint_play(spring, 0.05) == 0.0);
  CHECK(cli::joint_play(swing(0.05, 1.0, 0.1, 1.0, 0.0), 0.05) == 0.0);
}

TEST_CASE("Two logs of one joint are one fit", "[fit][joints]") {
  cli::JointLog log = swing(0.05, 1.0, 0.1, 1.0, 0.0);
  const cli::JointFit one = cli::fit_joint(log);
  cli::append(log, swing(0.05, 1.0, 0.1, 0.4, 0.0));
  CHECK(log.parts == std::vector<std::size_t>{5000});
  const cli::JointFit both = cli::fit_joint(log);
  CHECK(number_of(both, "inertia").value == Approx(0.05).margin(0.001));
  CHECK(number_of(both, "viscous").value == Approx(0.1).margin(0.005));
  CHECK(number_of(both, "base").value == Approx(1.0).epsilon(0.01));
  // The step from one log to the next is no motion, and adds nothing to the residual.
  CHECK(both.fitted_rms == Approx(one.fitted_rms).epsilon(0.1));
}

}  // namespace bristle_test::test_fit_joint
