// Files made to do harm: each ends in one short error line, soon, and in little memory.
#include <catch2/catch.hpp>

#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <future>
#include <iterator>
#include <sstream>
#include <string>
#include <vector>

#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/un.h>
#include <sys/wait.h>
#include <unistd.h>

#include <fmt/format.h>

#include "expect.hpp"
#include "temporary_folder.hpp"
#include "test_paths.hpp"
#include "tools/libraries/files/gnuplot.hpp"
#include "tools/libraries/files/number_text.hpp"
#include "tools/libraries/files/one_line.hpp"
#include "tools/libraries/files/toml_table.hpp"
#include "tools/libraries/files/toml_text.hpp"
#include "tools/libraries/files/user_error.hpp"

namespace bristle_test::test_hostile_files {

using Catch::Matchers::Contains;

namespace {

// Limit of the program's address space, kB; none with a sanitizer, which itself needs more.
#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
const std::string limits = "";
#else
const std::string limits = "ulimit -v 600000; ";
#endif

struct Outcome {
  int code = -1;
  std::string err, out;
};

std::size_t files_in(const std::filesystem::path& folder) {
  return static_cast<std::size_t>(std::distance(std::filesystem::directory_iterator(folder), {}));
}

bool has_gnuplot() { return std::system("command -v gnuplot >/dev/null") == 0; }

/// Runs a program with these words, no shell between, in the folder. `temporary`: its TMPDIR;
/// `variable`: another variable of its environment.
Outcome run_here(const TemporaryFolder& folder, std::vector<std::string> words,
                 const std::string& temporary = {}, const std::string& program = BRISTLE_CLI,
                 std::string variable = "BRISTLE_TEST=1") {
  const TemporaryFolder said;
  words.insert(words.begin(), program);
  const pid_t child = fork();
  REQUIRE(child >= 0);
  if (child == 0) {
    std::vector<char*> pointers;
    for (std::string& word : words) pointers.push_back(word.data());
    pointers.push_back(nullptr);
    if (!temporary.empty()) ::setenv("TMPDIR", temporary.c_str(), 1);
    ::putenv(variable.data());
    if (::chdir(folder.path.c_str()) != 0 || !std::freopen(said.at("out").c_str(), "wb", stdout) ||
        !std::freopen(said.at("err").c_str(), "wb", stderr))
      ::_exit(126);
    ::execv(program.c_str(), pointers.data());
    ::_exit(127);
  }
  int status = 0;
  ::waitpid(child, &status, 0);
  return {WIFEXITED(status) ? WEXITSTATUS(status) : -1, read_file(said.at("err")), read_file(said.at("out"))};
}

/// Runs `bristle ARGUMENTS` under limits, with the output of the command `input` as its input, if given.
Outcome run_limited(const TemporaryFolder& folder, const std::string& arguments,
                    const std::string& input = "") {
  const std::string command = (input.empty() ? "" : input + " 2>/dev/null | ") + "( " + limits +
                              "exec timeout 300 '" BRISTLE_CLI "' " + arguments + " >/dev/null 2>'" +
                              folder.at("stderr") + "' )";
  const int status = std::system(command.c_str());
  Outcome outcome;
  outcome.code = WIFEXITED(status) ? WEXITSTATUS(status) : -1;
  std::ifstream in(folder.at("stderr"), std::ios::binary);
  outcome.err.assign(std::istreambuf_iterator<char>(in), std::istreambuf_iterator<char>());
  return outcome;
}

void check_one_line(const Outcome& outcome, const std::string& part) {
  INFO(outcome.err.substr(0, 1000));
  CHECK(outcome.code == 2);
  CHECK(std::count(outcome.err.begin(), outcome.err.end(), '\n') == 1);
  CHECK(outcome.err.size() < 800);
  CHECK_THAT(outcome.err, Contains(part));
}

std::string repeated(const std::string& text, std::size_t times) {
  std::string all;
  all.reserve(text.size() * times);
  for (std::size_t i = 0; i < times; ++i) all += text;
  return all;
}

/// Returns the text of `count` patches, and for each a motion with the lines `motion_keys`.
std::string patches_with(int count, const std::string& motion_keys) {
  std::string all;
  for (int i = 0; i < count; ++i) {
    const std::string name = "p" + std::to_string(i);
    all += "[[patch]]\nname = \"" + name + "\"\nmaterial = \"wood\"\nmax_normal_load = 1.0\nbristles = 1\n" +
           "[[motion]]\npatch = \"" + name + "\"\n" + motion_keys + "\n";
  }
  return all;
}

std::string thousands_of_materials() {
  std::string all;
  for (int i = 0; i < 2000; ++i)
    all += "[[material]]\nname = \"m" + std::to_string(i) + "\"\npresliding_length = 1e-5\n";
  return all;
}

/// Returns a small valid scene of one patch, with `patch_keys` added to the patch.
std::string scene_with(const std::string& patch_keys) {
  return "[scene]\nname = \"small\"\ndt = 1e-3\nduration = 0.005\n"
         "[[material]]\nname = \"wood\"\npresliding_length = 1e-5\n"
         "[[patch]]\nname = \"tip\"\nmaterial = \"wood\"\nmax_normal_load = 1.0\n" +
         patch_keys + "\n[[motion]]\npatch = \"tip\"\ntype = \"ramp\"\nvelocity = 0.02\nload = 1.0\n";
}

}  // namespace

TEST_CASE("A scene file that means harm is refused in one line and little memory", "[cli][hostile]") {
  const TemporaryFolder folder;
  const struct {
    const char* name;
    std::string text;
    const char* message;
  } cases[] = {
      {"a number of millions of digits", "[scene]\nname = \"a\"\ndt = " + std::string(4'000'000, '9'), ":3:"},
      {"arrays nested deeply", "a = " + std::string(200'000, '['), "nested"},
      {"tables nested deeply", "a = " + repeated("{a = ", 200'000), "nested"},
      {"a key of many parts", "a" + repeated(".a", 500'000) + " = 1", "dots"},
      {"a table's name of many parts", "\n[a" + repeated(" . \"a\"", 500'000) + "]", ":2:"},
      {"keys of many parts nested", repeated("a = [{" + std::string("a") + repeated(".a", 15) + " = ", 255),
       "not TOML"},
      {"a zero byte", std::string("[scene]\nname = \"a\0b\"\n", 21), ":2: a zero byte"},
      {"no UTF-8", "[scene]\nname = \"\xff\xfe\"\n", "utf-8"},
      {"nothing", "", "[scene] is missing"},
      {"a million patches times a thousand", scene_with("bristles = 10\ncount = 1000000000"), "count"},
      {"a million patches of a thousand", scene_with("bristles = 1000\ncount = 1000000"), "bristles"},
      {"a thousand million bristles", scene_with("bristles = 1000000000"), "bristles"},
      {"not a number", scene_with("bristles = nan"), "nan"},
      {"infinity", scene_with("bristles = inf"), "inf"},
      {"a number beyond 64 bits", scene_with("bristles = 99999999999999999999"), "not TOML"},
      {"thousands of materials", scene_with("bristles = 10") + thousands_of_materials(),
       "is material 1001; allowed: at most 1000"},
      {"what a terminal would obey", "[scene]\nname = \"\\u001b]0;x\\u0007\\u009b31m\"\ndt = 1\n",
       "?]0;x???31m"},
  };
  for (const auto& c : cases) {
    INFO(c.name);
    check_one_line(run_limited(folder, "run '" + folder.write("scene.toml", c.text) + "'"), c.message);
  }
}

TEST_CASE("A scene of very many tables, or of one large trace many times, is soon read", "[cli][hostile]") {
  const TemporaryFolder folder;
  // Scene of a hundred thousand patches and motions, whose names would take minutes to look up one by one.
  const std::string many = scene_with("bristles = 10") +
                           patches_with(100'000, "type = \"hold\"\nload = 1.0") +
                           "[[motion]]\npatch = \"nobody\"\ntype = \"hold\"\nload = 1.0\n";
  check_one_line(run_limited(folder, "run '" + folder.write("scene.toml", many) + "'"), "names 'nobody'");
  // Trace of 20,000 rows, 32 bytes each, named by many motions: 640 MB if each had a copy.
  std::string trace = "t,x,load\n";
  for (int i = 0; i < 20'000; ++i) trace += std::to_string(i) + ",0,1\n";
  folder.write("trace.csv", trace);
  const std::string one_trace =
      scene_with("bristles = 10") + patches_with(1000, "type = \"trace\"\nfile = \"trace.csv\"");
  CHECK(run_limited(folder, "run '" + folder.write("scene.toml", one_trace) + "' --steps 1").code == 0);
}

TEST_CASE("A motion file that means harm is refused in one line and little memory", "[cli][hostile]") {
  const TemporaryFolder folder;
  const std::string run = "run '" + folder.write("scene.toml", scene_with("bristles = 10")) + "' --trace ";
  const std::string head = "t,x,load\n0,0,1\n";
  const struct {
    const char* name;
    std::string text;
    const char* message;
  } cases[] = {
      {"a number of millions of digits", head + "1," + std::string(4'000'000, '9') + ",1\n",
       "out of the range"},
      {"a line that does not end", head + std::string(20'000'000, '9'), "16 MiB"},
      {"a header that does not end", "t,x,load" + repeated(",a", 9'000'000), "16 MiB"},
      {"a header of millions of columns", "t,x,load" + repeated(",a", 1'000'000) + "\n0,0,1\n",
       "fewer cells"},
      {"a zero byte", std::string("t,x,load\n0,0\0,1\n", 16), ":2: a zero byte"},
      {"no UTF-8", head + "\xff\xfe,1,1\n", "not a number"},
      {"what a terminal would obey", head + "1,\x1b[31m,1\n", "'?[31m' is not a number"},
      {"nothing", "", "empty"},
      {"not a number", head + "1,nan,1\n", "not finite"},
      {"infinity", head + "1,-inf,1\n", "not finite"},
      {"a position out of the range of numbers", head + "1,1e400,1\n", "out of the range"},
      {"a position on another star", head + "1,1e17,1\n", "allowed: -1000000 to 1000000"},
      {"a time that has no end", "t,x,load\n-1e308,0,1\n1e308,0,1\n", "column t"},
      {"velocities that lead beyond numbers", "t,vx,load\n0,1e308,1\n1e308,1e308,1\n", "column vx"},
      {"velocities that lead far away", "t,vx,load\n0,1e6,1\n1e6,1e6,1\n", "lead to"},
  };
  for (const auto& c : cases) {
    INFO(c.name);
    const std::string file = folder.write("motion.csv", c.text);
    check_one_line(run_limited(folder, run + "'" + file + "'"), c.message);
  }
}

TEST_CASE("Places that are no files, and files without an end, are refused", "[cli][hostile]") {
  const TemporaryFolder folder;
  const std::string scene = folder.write("scene.toml", scene_with("bristles = 10"));
  const std::string commands[] = {"run ", "run '" + scene + "' --trace ", "fit ", "accuracy ",
                                  "experiment stribeck --config "};
  for (const std::string& command : commands) {
    INFO(command);
    check_one_line(run_limited(folder, command + "'" + folder.path.string() + "'"), "cannot be read");
    check_one_line(run_limited(folder, command + "/dev/zero"), "zero byte");
    check_one_line(run_limited(folder, command + "'" + folder.at("nothing") + "'"), "No such file");
  }
  // Streams ten gigabytes and more as a scene, without a disk to hold them.
  check_one_line(run_limited(folder, "run /dev/stdin", "tr '\\000' 9 </dev/zero"), "16 MiB");
  check_one_line(run_limited(folder, "run /dev/stdin", "yes '# a comment'"), "at most 64 MiB");
  check_one_line(run_limited(folder, "run '" + scene + "' --trace /dev/stdin", "tr '\\000' 9 </dev/zero"),
                 "16 MiB");
}

TEST_CASE("A FIFO that nobody has opened is waited for, and the command says so", "[cli][hostile]") {
  const TemporaryFolder folder;
  const std::string scene = folder.write("scene.toml", scene_with("bristles = 10"));
  struct Told {
    int code;
    std::string said;
  };
  // Starts a command in a thread, because commands wait for seconds. The shell commands `beside` run once the
  // program has said that it waits.
  const auto run = [&](const std::string& name, const std::string& arguments, const std::string& beside) {
    const std::string fifo = folder.at(name), said = folder.write(name + ".stderr", "");
    REQUIRE(::mkfifo(fifo.c_str(), 0600) == 0);
    const std::string script = folder.write(
        name + ".sh", "(for i in $(seq 200); do [ -s '" + said + "' ] && break; sleep 0.05; done\n" + beside +
                          ") &\ntimeout " + (beside.empty() ? "-s INT 4" : "20") + " '" BRISTLE_CLI "' run " +
                          arguments + " >/dev/null 2>'" + said + "'; code=$?; wait; exit $code\n");
    return std::async(std::launch::async, [=] {
      const int status = std::system(("timeout 30 sh '" + script + "'").c_str());
      std::ifstream in(said);
      return Told{WEXITSTATUS(status), std::string(std::istreambuf_iterator<char>(in), {})};
    });
  };
  const std::string read = folder.at("read"), written = folder.at("written"), left = folder.at("left");
  auto reads = run("read", "'" + read + "'", "cat '" + scene + "' >'" + read + "'");
  auto writes = run("written", "'" + scene + "' --out '" + written + "'",
                    "cat '" + written + "' >'" + folder.at("forces") + "'");
  auto waits = run("left", "'" + left + "'", "");  // nothing writes to the file, so Ctrl-C ends the program
  const Told reader = reads.get(), writer = writes.get(), alone = waits.get();
  CHECK(reader.code == 0);
  CHECK(reader.said == "bristle: " + read + ": a FIFO that nobody writes to yet; waiting (Ctrl-C ends it)\n");
  CHECK(writer.code == 0);
  CHECK(writer.said == "bristle: " + written + ": a FIFO that nobody reads yet; waiting (Ctrl-C ends it)\n");
  CHECK(std::filesystem::file_size(folder.at("forces")) > 100);
  CHECK(alone.code == 124);
  CHECK_THAT(alone.said, Contains("nobody writes"));
}

TEST_CASE("Windows line ends, a byte order mark and a pipe are no fault", "[cli][hostile]") {
  const TemporaryFolder folder;
  std::string text = "\xEF\xBB\xBF" + scene_with("bristles = 10");
  for (std::size_t at = 0; (at = text.find('\n', at)) != std::string::npos; at += 2) text.insert(at, "\r");
  const std::string scene = folder.write("scene.toml", text);
  const std::string motion = folder.write("motion.csv", "\xEF\xBB\xBFt,x,load\r\n0,0,1\r\n0.01,1e-5,1\r\n");
  CHECK(run_limited(folder, "run '" + scene + "'").code == 0);
  CHECK(run_limited(folder, "run '" + scene + "' --trace '" + motion + "'").code == 0);
  CHECK(run_limited(folder, "run '" + scene + "' --trace /dev/stdin", "cat '" + motion + "'").code == 0);
}

TEST_CASE("A message is one short line that no terminal obeys", "[cli][hostile]") {
  CHECK(cli::one_line("a\nb\tc\x1b[0m\x7f") == "a b?c?[0m?");
  CHECK(cli::one_line("2 \xC2\xB5m, \xE2\x82\xAC") == "2 \xC2\xB5m, \xE2\x82\xAC");
  CHECK(cli::one_line("\xC2\x9B"
                      "31m") == "??31m");
  CHECK(cli::one_line("\xff\xC2") == "??");
  // Forms longer than needed (an escape, a slash), a surrogate, and what lies beyond Unicode, beside the
  // nearest characters that are valid.
  CHECK(cli::one_line("\xE0\x80\x9B[31m") == "???[31m");
  CHECK(cli::one_line("\xF0\x80\x80\xAF") == "????");
  CHECK(cli::one_line("\xED\xA0\x80") == "???");
  CHECK(cli::one_line("\xF4\x90\x80\x80") == "????");
  for (const char* valid : {"\xE0\xA0\x80", "\xF0\x90\x80\x80", "\xED\x9F\xBF", "\xF4\x8F\xBF\xBF"})
    CHECK(cli::one_line(valid) == valid);
  CHECK(cli::one_line("\xF0\x9F\x98") == "???");
  const std::string line = cli::one_line("first " + std::string(1'000'000, '9') + " last");
  CHECK(line.size() < 800);
  CHECK_THAT(line, Contains("first 99") && Contains("99 ... 99") && Contains("99 last"));
}

TEST_CASE("A scene does not show what stands in a file that is no motion", "[hostile]") {
  const TemporaryFolder folder;
  folder.write("secret", "root:x:0:0:root:/root:/bin/bash\nmore\n");
  const Outcome outcome = run_limited(
      folder,
      "run " + folder.write("s.toml",
                            "[scene]\nname = \"s\"\ndt = 1e-3\n[[material]]\nname = \"m\"\n[[patch]]\nname = "
                            "\"p\"\nmaterial = \"m\"\nmax_normal_load = 1.0\n[[motion]]\npatch = "
                            "\"p\"\ntype = \"trace\"\nfile = \"secret\"\n"));
  check_one_line(outcome, "secret:1: names no column of a motion file");
  CHECK(outcome.err.find("root") == std::string::npos);
}

TEST_CASE("A report keeps its lines and colours, and no other control character", "[hostile]") {
  CHECK(cli::masked("a\nb\x1b[31mc\x1b[0m\x1b]0;t\x07") == "a\nb?[31mc?[0m?]0;t?");
  CHECK(cli::masked("a\nb\x1b[1;31mc\x1b[0m\x1b]0;t\x07\x1b[2J\x1b[3", true) ==
        "a\nb\x1b[1;31mc\x1b[0m?]0;t??[2J?[3");
}

// ------------------------------------------------------------------------------------ names and commands

TEST_CASE("gnuplot gets a name byte by byte", "[hostile]") {
  if (!has_gnuplot()) return;
  const TemporaryFolder folder;
  std::string every;
  for (int byte = 1; byte < 256; ++byte) every += static_cast<char>(byte);
  const std::string out = folder.at("bytes");
  cli::run_gnuplot("set print " + cli::gnuplot_file(out) + "\nprint " + cli::gnuplot_string(every) + '\n',
                   "x");
  CHECK(read_file(out) == every + '\n');
  CHECK(message_of<cli::UserError>([] { cli::run_gnuplot("no command\n", "--plot"); }) ==
        "--plot: gnuplot failed");
}

TEST_CASE("No script of gnuplot starts a program", "[cli][hostile]") {
  int scripts = 0;
  for (const auto& entry : std::filesystem::directory_iterator(BRISTLE_SCENES "/../plots")) {
    if (entry.path().extension() != ".gp") continue;
    ++scripts;
    std::istringstream text(read_file(entry.path().string()));
    for (std::string line; std::getline(text, line);) {
      if (line.starts_with('#')) continue;
      // Calls, back quotes, names that are pipes, and lines that are for the shell.
      for (const char* start : {"system", "shell", "popen", "`", "\"<", "'<", "\"|", "'|"})
        if (line.find(start) != std::string::npos) FAIL_CHECK(entry.path() << ": " << line);
      CHECK(!line.starts_with('!'));
    }
  }
  CHECK(scripts > 20);
}

TEST_CASE("No name is a command, of a shell or of gnuplot", "[cli][hostile]") {
  if (!has_gnuplot()) return;
  const TemporaryFolder folder;
  const std::string names[] = {"$(touch executed)",
                               "`touch executed`",
                               "x'\n!touch executed\n'",
                               "x\n!touch executed",
                               "|touch executed;",
                               "<touch executed;",
                               "x\";!touch executed",
                               "a' 'b\"c\\d",
                               "-e system('touch executed')",
                               "$samples",
                               "\x1b]0;title\x07 %s",
                               "~"};
  std::string record = "t,x,load,force\n";
  for (int i = 0; i < 120; ++i)
    record += fmt::format("{},{},1,{}\n", i * 1e-3, 1e-6 * (i < 60 ? i : 120 - i), i < 60 ? 0.4 : -0.4);
  for (const std::string& name : names) {
    CAPTURE(name);
    // Names after "./", so that "-e" is no option; gnuplot must not see a name that begins with '|' either.
    const std::string picture = "./" + name + ".svg", data = "./" + name + ".csv";
    const Outcome drawn = run_here(folder, {"experiment", "drift", "--models", "coulomb", "--plot", picture});
    CHECK(drawn.err == "");
    CHECK(drawn.code == 0);
    CHECK_THAT(read_file(folder.at(name + ".svg")), Contains("</svg>"));
    folder.write(name + ".csv", record);
    std::filesystem::create_directory(folder.at("TMP" + name));
    const Outcome below =
        run_here(folder, {"experiment", "drift", "--models", "coulomb", "--plot", "below.svg"}, "TMP" + name);
    CHECK(below.err == "");
    CHECK(below.code == 0);
    const Outcome fitted = run_here(folder, {"fit", data, "--plot", "fit.svg"});
    CAPTURE(fitted.err);
    CHECK(fitted.code == 0);
    CHECK_THAT(read_file(folder.at("fit.svg")), Contains("</svg>"));
    CHECK(std::none_of(fitted.out.begin(), fitted.out.end(),
                       [](char c) { return c >= 0 && c < ' ' && c != '\n'; }));
    CHECK_FALSE(std::filesystem::exists(folder.at("executed")));
    CHECK_FALSE(std::filesystem::exists(folder.at("TMP" + name) + "/executed"));
    CHECK(std::filesystem::is_empty(folder.at("TMP" + name)));
  }
}

// ------------------------------------------------------------------------------------------------ numbers

TEST_CASE("A number that cannot be held is refused, and one that can is taken whole", "[hostile]") {
  const auto number = [](const std::string& text) {
    const toml::table table = cli::parse_toml("x = " + text + "\n", "f.toml");
    return cli::TomlTable("f.toml", table, "[scene]").number("x", {-1e300, 1e300});
  };
  CHECK(number("9007199254740992") == 0x1p53);
  CHECK(number("-9007199254740992") == -0x1p53);
  CHECK(number("9007199254740994.0") == 9007199254740994.0);
  for (const char* text : {"9007199254740993", "-9007199254740993", "9223372036854775807",
                           "-9223372036854775808", "inf", "-inf", "nan"}) {
    CAPTURE(text);
    CHECK_THAT(message_of<cli::UserError>([&] { number(text); }), Contains("f.toml:1: [scene]: x is"));
  }
  CHECK(cli::number_in<double>("+2.5") == 2.5);
  CHECK(cli::number_in<int>("-7") == -7);
  for (const char* text : {"", "+", "+-1", "1e400", "inf", "nan", "0x10", " 1", "1 ", "1junk", "1,5"}) {
    CAPTURE(text);
    CHECK_FALSE(cli::number_in<double>(text));
  }
  CHECK_FALSE(cli::number_in<std::uint32_t>("-1"));
  CHECK_FALSE(cli::number_in<std::uint32_t>("4294967296"));
  CHECK_FALSE(cli::number_in<int>("1.5"));
}

TEST_CASE("Scenes with names of files that are none are refused with file, line and key", "[cli][hostile]") {
  const TemporaryFolder folder;
  folder.write("motion.csv", "t,x,load\n0,0,1\n0.01,1e-5,1\n");
  const std::string trace = "type = \"trace\"\nfile = \"";
  const auto refused = [&](const std::string& text, const std::string& part) {
    check_one_line(run_here(folder, {"run", folder.write("s.toml", text)}), part);
  };
  const std::string scene = scene_with("bristles = 10");
  for (const std::string name : {"", "motion.csv\\u0000.png", "\\u0000"}) {
    CAPTURE(name);
    std::string with_trace = scene.substr(0, scene.find("[[motion]]"));
    with_trace += "[[motion]]\npatch = \"tip\"\n" + trace + name + "\"\n";
    refused(with_trace, "file is '");
  }
  refused("x = " + std::string(300, '[') + std::string(300, ']') + "\n", "s.toml:1: not TOML");
  CHECK_THAT(run_here(folder, {"run", folder.at("s.toml")}).err, !Contains("TOML_"));
}

// --------------------------------------------------------------------------------------- limits of the
// system

TEST_CASE("Limits of the system end in one line and leave nothing", "[cli][hostile]") {
  const TemporaryFolder folder;
  const std::string scene = folder.write("s.toml", scene_with("bristles = 10"));
  const std::string run = "'" BRISTLE_CLI "' run '" + scene + "' ";
  const auto shell = [&](const std::string& text) { return run_here(folder, {"-c", text}, {}, "/bin/sh"); };
  const std::size_t files = files_in(folder.path);
  // A limit of no block, of regular files: messages go through a pipe.
  const Outcome limited =
      shell("( ulimit -f 0; " + run + "--out forces.csv; echo code $? >&2 ) 2>&1 >/dev/null | cat >&2");
  CHECK_THAT(limited.err, Contains("forces.csv") && Contains("File too large\ncode 2\n"));
  CHECK(std::count(limited.err.begin(), limited.err.end(), '\n') == 2);
  CHECK(files_in(folder.path) == files);
  const Outcome removed = shell("mkdir gone; cd gone; rmdir ../gone; " + run + "--out forces.csv");
  check_one_line(removed, "No such file");
  check_one_line(shell("mkdir gone; cd gone; rmdir ../gone; exec '" BRISTLE_CLI "' sweep '" + scene +
                       "' --vary scene.dt=1e-3 --out t.csv"),
                 "t.csv");
  check_one_line(run_here(folder, {"run", BRISTLE_SCENES "/wheel.toml", "--isa", "z80"}), "z80");
  check_one_line(run_here(folder, {"--version"}, {}, BRISTLE_CLI, "BRISTLE_ISA=z80"), "z80");
  const int socket = ::socket(AF_UNIX, SOCK_STREAM, 0);
  sockaddr_un address{};
  address.sun_family = AF_UNIX;
  folder.at("socket").copy(address.sun_path, sizeof address.sun_path - 1);
  REQUIRE(::bind(socket, reinterpret_cast<const sockaddr*>(&address), sizeof address) == 0);
  check_one_line(run_here(folder, {"run", scene, "--out", "socket"}), "socket: cannot be written");
  check_one_line(run_here(folder, {"run", "socket"}), "socket: cannot be read");
  ::close(socket);
}

}  // namespace bristle_test::test_hostile_files
