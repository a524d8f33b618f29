// No command damages a user's files: inputs are never written, outputs are whole or absent.
#include <catch2/catch.hpp>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <csignal>
#include <cstdlib>
#include <filesystem>
#include <string>
#include <thread>

#include <fcntl.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

#include "command_line.hpp"
#include "tools/libraries/files/output_file.hpp"
#include "tools/libraries/files/user_error.hpp"

namespace bristle_test::test_output_files {

using Catch::Matchers::Contains;

namespace {

namespace fs = std::filesystem;

const std::string scene =
    "[scene]\nname = \"small\"\ndt = 1e-3\nduration = 0.05\n"
    "[[material]]\nname = \"wood\"\npresliding_length = 1e-5\n"
    "[[patch]]\nname = \"tip\"\nmaterial = \"wood\"\nmax_normal_load = 1.0\nbristles = 100\n"
    "[[motion]]\npatch = \"tip\"\ntype = \"trace\"\nfile = \"motion.csv\"\n";
const std::string motion = "t,x,load\n0,0,1\n0.05,1e-3,1\n";

/// Returns the CSV text of a slide to and fro that `bristle fit` accepts.
std::string record() {
  std::string text = "t,x,load,force\n";
  for (int i = 0; i < 400; ++i) {
    const double x = 1e-6 * (i < 200 ? i : 400 - i), force = i < 200 ? -0.4 : 0.4;
    text +=
        std::to_string(i * 1e-3) + "," + std::to_string(1e3 * x) + "e-3,1," + std::to_string(force) + "\n";
  }
  return text;
}

std::size_t files_in(const fs::path& folder) {
  return static_cast<std::size_t>(std::distance(fs::directory_iterator(folder), {}));
}

/// Returns whether a command has begun to write the file `out` in a folder: its temporary file is there.
bool writes_out(const std::string& folder) {
  return std::any_of(fs::directory_iterator(folder), fs::directory_iterator(), [](const auto& entry) {
    return entry.path().filename().string().starts_with("out.tmp.");
  });
}

}  // namespace

TEST_CASE("No command writes over a file that it reads, or two outputs into one", "[cli][files]") {
  const TemporaryFolder folder;
  const std::string s = folder.write("s.toml", scene), m = folder.write("motion.csv", motion),
                    d = folder.write("d.csv", record());
  const std::string plain = folder.write("plain.toml", "[scene]\n");
  const std::string hard = folder.at("hard.toml"), soft = folder.at("soft.toml");
  fs::create_hard_link(s, hard);
  fs::create_symlink(s, soft);
  const std::string commands[] = {
      "accuracy " + s + " --json " + s,
      "run " + s + " --out " + s,
      "run " + s + " --out " + hard,
      "run " + s + " --out " + soft,
      "run " + s + " --out " + folder.at("../") + folder.path.filename().string() + "/s.toml",
      "run " + s + " --json " + s,
      "run " + s + " --save-state " + s,
      "run " + s + " --out " + m,
      "run " + s + " --trace " + d + " --out " + d,
      "run " + s + " --out " + folder.at("x") + " --json " + folder.at("x"),
      "run " + s + " --out " + folder.at("x") + " --save-state " + folder.at("x"),
      "fit " + d + " --csv " + d,
      "fit " + d + " --write " + d,
      "fit " + d + " --json " + d,
      "fit " + d + " --csv " + folder.at("x.png") + " --plot " + folder.at("x.png"),
      "fit " + d + " --csv " + folder.at("x") + " --json " + folder.at("x"),
      "sweep " + s + " --vary material.wood.kinetic=0.3,0.4 --out " + s,
      "sweep " + s + " --vary material.wood.kinetic=0.3,0.4 --out " + m,
      "sweep " + s + " --vary material.wood.kinetic=0.3,0.4 --out " + folder.at("x") + " --json " +
          folder.at("x"),
      "stability --quick --json " + folder.at("x") + " --csv " + folder.at("x"),
      "capacity --quick --json " + folder.at("x") + " --csv " + folder.at("x"),
      "experiment drift --csv " + folder.at("x") + " --json " + folder.at("x"),
      "experiment drift --config " + plain + " --csv " + plain,
  };
  const std::size_t files = files_in(folder.path);
  for (const std::string& command : commands) {
    const auto begun = std::chrono::steady_clock::now();
    const Outcome outcome = run_cli(folder, command);
    INFO(command << "\n" << outcome.err);
    CHECK(outcome.code == 2);
    CHECK(std::count(outcome.err.begin(), outcome.err.end(), '\n') == 1);
    CHECK_THAT(outcome.err, Contains("another"));
    // The refusal must come before any computation.
    CHECK(std::chrono::steady_clock::now() - begun < std::chrono::seconds(5));
    CHECK(read_file(s) == scene);
    CHECK(read_file(m) == motion);
    CHECK(read_file(d) == record());
    CHECK(read_file(plain) == "[scene]\n");
    CHECK(files_in(folder.path) == files + 1);  // one new file: the program's stderr
  }
}

TEST_CASE("A run goes on from a state file and leaves its end in the same one", "[cli][files]") {
  const TemporaryFolder folder;
  const std::string s = folder.write("s.toml", scene), state = folder.at("state");
  folder.write("motion.csv", motion);
  REQUIRE(run_cli(folder, "run " + s + " --steps 20 --save-state " + state).code == 0);
  CHECK(
      run_cli(folder, "run " + s + " --steps 20 --restore-state " + state + " --save-state " + state).code ==
      0);
}

TEST_CASE("A sweep takes no unfinished table that is not its own", "[cli][files]") {
  const TemporaryFolder folder;
  const std::string s = folder.write("s.toml", scene);
  folder.write("motion.csv", motion);
  const std::string study =
      "sweep " + s + " --vary material.wood.kinetic=0.3,0.4 --out " + folder.at("t.csv");
  const std::string part = folder.write("t.csv.part", "my notes, one line without an end");
  const Outcome outcome = run_cli(folder, study);
  CHECK(outcome.code == 2);
  CHECK_THAT(outcome.err, Contains("is no unfinished table of bristle sweep"));
  CHECK(read_file(part) == "my notes, one line without an end");
  // Refuses a link in place of the unfinished table.
  fs::remove(part);
  fs::create_symlink(folder.write("elsewhere", ""), part);
  CHECK(run_cli(folder, study).code == 2);
}

TEST_CASE("The writer leaves the old file until the new one is whole", "[files]") {
  const TemporaryFolder folder;
  const std::string path = folder.write("out", "old");
  fs::permissions(path, fs::perms::owner_read | fs::perms::owner_write);
  {
    cli::OutputFile file(path);
    file.append("new");
    file.flush();
    CHECK(read_file(path) == "old");
    CHECK(files_in(folder.path) == 2);
  }
  CHECK(read_file(path) == "old");
  CHECK(files_in(folder.path) == 1);
  cli::OutputFile(path).write("new");
  CHECK(read_file(path) == "new");
  CHECK(fs::status(path).permissions() == (fs::perms::owner_read | fs::perms::owner_write));
  // Checks that an OutputFile that was moved from does not remove the temporary file a second time.
  {
    cli::OutputFile first(path), second;
    second = std::move(first);
    second.append("lost");
  }
  CHECK(files_in(folder.path) == 1);

  // Checks that writing through a link keeps the link and replaces the file that it leads to.
  const std::string link = folder.at("link");
  fs::create_symlink(path, link);
  cli::OutputFile(link).write("through");
  CHECK(fs::is_symlink(link));
  CHECK(read_file(path) == "through");

  // Keeps a write-protected file, though its folder could take another in its place. Root may write it.
  fs::permissions(path, fs::perms::owner_read);
  fs::permissions(folder.path, fs::perms::all);
  const pid_t child = ::fork();
  REQUIRE(child >= 0);
  if (child == 0) {
    if (::getuid() == 0 && ::setuid(65534) != 0) ::_exit(2);
    try {
      cli::OutputFile{path};
    } catch (const cli::UserError&) {
      ::_exit(0);
    }
    ::_exit(1);
  }
  int status = -1;
  REQUIRE(::waitpid(child, &status, 0) == child);
  CHECK(status == 0);

  CHECK_THROWS_AS(cli::OutputFile(folder.at("none/out")), cli::UserError);
  CHECK_THROWS_AS(cli::OutputFile(folder.path.string()), cli::UserError);
  CHECK_THROWS_AS(cli::OutputFile("/dev/full").write("x"), cli::UserError);
}

TEST_CASE("A full disk is said, whoever writes, and a closed stderr ends nothing", "[cli][files]") {
  const TemporaryFolder folder;
  const std::string s = folder.write("s.toml", scene), d = folder.write("d.csv", record());
  folder.write("motion.csv", motion);
  const auto code_of = [&](const std::string& command) {
    const int status = std::system(command.c_str());
    return WIFEXITED(status) ? WEXITSTATUS(status) : -1;
  };
  const std::string bristle = "'" BRISTLE_CLI "' ", error = folder.at("error");
  for (const std::string command : {"--help", "--version", "run --help", "completion", "experiment list"}) {
    INFO(command);
    CHECK(code_of(bristle + command + " > /dev/full 2> " + error) == 2);
    CHECK_THAT(read_file(error), Contains("standard output: cannot be written: No space left on device"));
    CHECK(code_of(bristle + command + " >&- 2> " + error) == 2);
  }
  for (const std::string option : {"--out", "--json"})
    CHECK(code_of(bristle + "run " + s + " " + option + " /dev/full > /dev/null 2> " + error) == 2);
  CHECK(code_of(bristle + "fit " + d + " --csv /dev/full > /dev/null 2> " + error) == 2);
  const std::string full = folder.at("full.csv");
  fs::create_symlink("/dev/full", full);
  CHECK(code_of(bristle + "sweep " + s + " --vary material.wood.kinetic=0.3,0.4 --out " + full +
                " > /dev/null 2> " + error) == 2);
  CHECK_FALSE(fs::exists(full + ".part"));  // nothing beside a device
  CHECK(code_of(bristle + "nonsense 2>&-") == 2);
  CHECK(code_of(bristle + "run nowhere.toml 2>&- >&-") == 2);
  // An output must not get the descriptor of the closed stderr, because messages would be written into the
  // file.
  REQUIRE(code_of(bristle + "run " + s + " --out " + folder.at("f.csv") + " > /dev/null 2>&-") == 0);
  CHECK(read_file(folder.at("f.csv")).starts_with("t,patch,fx"));
}

TEST_CASE("A command that is stopped leaves the old file whole and nothing beside it", "[cli][files]") {
  const TemporaryFolder folder;
  const std::string long_scene = folder.write(
      "long.toml",
      "[scene]\nname = \"long\"\ndt = 1e-3\nduration = 5e5\n" +
          scene.substr(scene.find("[[material]]"), scene.find("[[motion]]") - scene.find("[[material]]")) +
          "[[motion]]\npatch = \"tip\"\ntype = \"ramp\"\nvelocity = 0.02\nload = 1.0\n");
  const std::string out = folder.write("out", "old");
  for (const std::string& command : {"run " + long_scene + " --out " + out, "stability --json " + out,
                                     "accuracy '" BRISTLE_SCENES "/fingertip.toml' --csv " + out}) {
    for (const int signal : {SIGINT, SIGTERM}) {
      INFO(command << ", signal " << signal);
      const pid_t child = ::fork();
      REQUIRE(child >= 0);
      if (child == 0) {
        const int nothing = ::open("/dev/null", O_WRONLY);
        ::dup2(nothing, 1);
        ::dup2(nothing, 2);
        ::execl("/bin/sh", "sh", "-c", ("exec '" BRISTLE_CLI "' " + command).c_str(), nullptr);
        ::_exit(127);
      }
      // Waits for the temporary file beside the output, which shows that the command has begun.
      const auto begun = [&] { return writes_out(folder.path); };
      for (int k = 0; k < 2000 && !begun(); ++k) std::this_thread::sleep_for(std::chrono::milliseconds(5));
      CHECK(begun());
      ::kill(child, signal);
      int status = 0;
      REQUIRE(::waitpid(child, &status, 0) == child);
      CHECK((WIFSIGNALED(status) && WTERMSIG(status) == signal));
      CHECK(read_file(out) == "old");
      CHECK_FALSE(begun());
    }
  }
}

TEST_CASE("A fit that Ctrl-C stops reports the best found until then; a long one is announced",
          "[cli][files]") {
  const TemporaryFolder folder;
  std::string friction = "t,x,load,force\n", joint = "t,angle,speed,motor\n";
  for (int i = 0; i < 10000; ++i) {
    const double t = 1e-2 * i, x = 5e-5 * (1.0 + std::sin(0.37 * t)) * std::sin(2.0 * t);
    friction += std::to_string(t) + "," + std::to_string(1e6 * x) + "e-6,2," +
                std::to_string(0.6 * std::tanh(x / 1e-5 + std::cos(2.0 * t))) + "\n";
  }
  for (int i = 0; i < 48000; ++i) {
    const double t = 2e-3 * i, speed = std::cos(2.0 * t) + 0.3 * std::cos(7.0 * t);
    joint += std::to_string(t) + "," +
             std::to_string(0.5 * std::sin(2.0 * t) + 0.3 / 7.0 * std::sin(7.0 * t)) + "," +
             std::to_string(speed) + "," + std::to_string(speed > 0.0 ? 1.0 : -1.0) + "\n";
  }
  const std::string record_file = folder.write("friction.csv", friction),
                    log = folder.write("joint.csv", joint), report = folder.at("out");
  for (const bool of_joint : {false, true}) {
    CAPTURE(of_joint);
    // The program's standard error is a terminal, on which it announces long work.
    const int terminal = ::posix_openpt(O_RDWR | O_NOCTTY);
    REQUIRE(terminal >= 0);
    REQUIRE((::grantpt(terminal) == 0 && ::unlockpt(terminal) == 0));
    const std::string side = ::ptsname(terminal), said = folder.at("said");
    const pid_t child = ::fork();
    REQUIRE(child >= 0);
    if (child == 0) {
      ::dup2(::open(said.c_str(), O_WRONLY | O_CREAT | O_TRUNC, 0600), 1);
      ::dup2(::open(side.c_str(), O_RDWR | O_NOCTTY), 2);
      const std::string& data = of_joint ? log : record_file;
      ::execl(BRISTLE_CLI, "bristle", "fit", data.c_str(), "--json", report.c_str(),
              of_joint ? "--joint" : static_cast<const char*>(nullptr), "--rivals", nullptr);
      ::_exit(127);
    }
    // Sends the signal once the fit has begun: its output file is there or, for a joint, it is announced.
    ::fcntl(terminal, F_SETFL, O_NONBLOCK);
    std::string shown;
    const auto begun = [&] {
      char text[512];
      for (ssize_t got = 0; (got = ::read(terminal, text, sizeof text)) > 0;)
        shown.append(text, static_cast<std::size_t>(got));
      if (of_joint) return shown.find("will take about") != shown.npos;
      return writes_out(folder.path);
    };
    for (int k = 0; k < 4000 && !begun(); ++k) std::this_thread::sleep_for(std::chrono::milliseconds(5));
    CHECK(begun());
    ::kill(child, SIGINT);
    int status = 0;
    REQUIRE(::waitpid(child, &status, 0) == child);
    ::close(terminal);
    CHECK((WIFEXITED(status) && WEXITSTATUS(status) == 0));
    const std::string text = read_file(said);
    CHECK_THAT(text, Contains("stopped early"));
    CHECK_THAT(text, Contains(of_joint ? "inertia" : "kinetic"));
    CHECK_THAT(read_file(report), Contains(of_joint ? "bristle-fit-joint-1" : "bristle-fit-1"));
    if (of_joint) CHECK_THAT(shown, Contains("Ctrl-C gives the best found until then"));
    fs::remove(report);
  }
}

}  // namespace bristle_test::test_output_files
