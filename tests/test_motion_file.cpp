// The parser of motion files: units, optional columns, and which lines it refuses.
#include <catch2/catch.hpp>

#include <cmath>
#include <string>

#include "expect.hpp"
#include "tools/libraries/files/motion_file.hpp"
#include "tools/libraries/files/user_error.hpp"

namespace bristle_test::test_motion_file {

using cli::MotionFile;
using cli::parse_motion_file;

namespace {

/// Returns the message with which the parser refuses `text`; empty if it accepts it.
std::string refusal(const std::string& text) {
  return message_of<cli::UserError>([&] { parse_motion_file(text, "hand.csv"); });
}

}  // namespace

TEST_CASE("A motion file gives time, position and load in SI units", "[motion file]") {
  const MotionFile file = parse_motion_file("t,x,y,load\n0,0.25,-0.5,1\n0.001,0.5,1e-3,0\n", "hand.csv");
  REQUIRE(file.rows.size() == 2);
  CHECK(file.rows[0].t == 0.0);
  CHECK(file.rows[0].x == 0.25);
  CHECK(file.rows[0].y == -0.5);
  CHECK(file.rows[0].load == 1.0);
  CHECK(file.rows[1].t == 0.001);
  CHECK(file.rows[1].x == 0.5);
  CHECK(file.rows[1].y == 1e-3);
  CHECK(file.rows[1].load == 0.0);
  CHECK(file.has_y);
  CHECK(file.has_load);
  CHECK_FALSE(file.from_velocity);
}

TEST_CASE("Units in the header scale a column, in any order, with or without spaces", "[motion file]") {
  const MotionFile file =
      parse_motion_file("load [mN],x[mm], y[um] ,t[ms]\n250,1.5,30,0\n500,-1.5,-60,2\n", "hand.csv");
  REQUIRE(file.rows.size() == 2);
  // Units are converted by division by a power of ten, which rounds once. So values are the doubles nearest
  // to the decimals meant.
  CHECK(file.rows[0].x == 0.0015);
  CHECK(file.rows[0].y == 0.00003);
  CHECK(file.rows[0].load == 0.25);
  CHECK(file.rows[1].t == 0.002);
  CHECK(file.rows[1].x == -0.0015);
  CHECK(file.rows[1].load == 0.5);
}

TEST_CASE("Loads may come in micronewtons and in gram-force", "[motion file]") {
  MotionFile file = parse_motion_file("t,x,load[uN]\n0,0,250\n1,0,1500000\n", "hand.csv");
  CHECK(file.rows[0].load == 0.00025);
  CHECK(file.rows[1].load == 1.5);
  file = parse_motion_file("t,x,load[gf]\n0,0,1\n1,0,50\n", "hand.csv");
  // Loads given in gf (gram-force): the weight of that many grams under standard gravity.
  CHECK(file.rows[0].load == Approx(9.80665e-3).epsilon(1e-15));
  CHECK(file.rows[1].load == Approx(0.4903325).epsilon(1e-15));
  CHECK(refusal("t,x,load[kg]\n0,0,1\n1,0,1\n") ==
        "hand.csv:1: unit of column load is 'kg'; allowed: N, mN, uN, kN, gf, kgf");
}

TEST_CASE("Loads that a sensor shows at zero are 0 where a motion file is to be clipped", "[motion file]") {
  const std::string text = "t,x,load\n0,0,-1e-5\n1,0,2\n2,0,-9e-5\n3,0,0\n";
  const MotionFile file = parse_motion_file(text, "hand.csv", 1e-4);
  const double loads[] = {0.0, 2.0, 0.0, 0.0};
  for (std::size_t i = 0; i < 4; ++i) {
    CHECK(file.rows[i].load == loads[i]);
    CHECK_FALSE(std::signbit(file.rows[i].load));
  }
  CHECK(refusal(text) ==
        "hand.csv:2: column load: -1e-5 is negative; allowed: 0 or more; clip_load in the scene's "
        "[[motion]], or --clip-load, takes what a sensor shows at zero load as 0");
  CHECK_THROWS_WITH(
      parse_motion_file("t,x,load[mN]\n0,0,-0.2\n1,0,1\n", "hand.csv", 1e-4),
      Catch::Matchers::Contains("hand.csv:2: column load: -0.2 is negative; allowed: -0.0001 N or more"));
}

TEST_CASE("A column y, a column load and a last line end may be left out", "[motion file]") {
  const MotionFile file = parse_motion_file("t,x\n0,1\n1,2", "hand.csv");
  REQUIRE(file.rows.size() == 2);
  CHECK_FALSE(file.has_y);
  CHECK_FALSE(file.has_load);
  CHECK(file.rows[1].x == 2.0);
}

TEST_CASE("Velocities are integrated by trapezoids from the origin", "[motion file]") {
  const MotionFile file =
      parse_motion_file("t[ms],vx[mm/s],vy,load\n0,0,1,1\n500,8,1,1\n1000,8,3,1\n", "hand.csv");
  REQUIRE(file.rows.size() == 3);
  CHECK(file.from_velocity);
  CHECK(file.rows[0].x == 0.0);
  CHECK(file.rows[1].x == Approx(0.002).epsilon(1e-15));
  CHECK(file.rows[2].x == Approx(0.006).epsilon(1e-15));
  CHECK(file.rows[1].y == Approx(0.5).epsilon(1e-15));
  CHECK(file.rows[2].y == Approx(1.5).epsilon(1e-15));
}

TEST_CASE("Other columns are ignored and named", "[motion file]") {
  const MotionFile file =
      parse_motion_file("t,note,x,vx,load,fx[N]\n0,hello,1,9,1,oops\n1,,2,nan,1,\n", "hand.csv");
  REQUIRE(file.rows.size() == 2);
  CHECK(file.rows[1].x == 2.0);
  CHECK(file.ignored_columns == std::vector<std::string>{"note", "fx[N]", "vx"});
}

TEST_CASE("Comments, a byte order mark and Windows line ends are no trouble", "[motion file]") {
  const MotionFile file = parse_motion_file(
      "\xEF\xBB\xBF# made by hand\r\nt,x,load\r\n0,1,1\r\n# a pause\r\n1,+2,1\r\n", "hand.csv");
  REQUIRE(file.rows.size() == 2);
  CHECK(file.rows[1].x == 2.0);
}

TEST_CASE("Numbers are read to the last digit", "[motion file]") {
  const MotionFile file =
      parse_motion_file("t,x,load\n0,0.1,1\n1,123456.789012345678,4.9e-324\n", "hand.csv");
  CHECK(file.rows[0].x == 0.1);
  CHECK(file.rows[1].x == 123456.789012345678);
  CHECK(file.rows[1].load == 4.9e-324);
}

TEST_CASE("A bad row is refused by line, column and reason", "[motion file]") {
  struct Case {
    const char* text;
    const char* message;
  };
  const Case cases[] = {
      {"t,x,load\n0,1,1\n1,abc,1\n", "hand.csv:3: column x: 'abc' is not a number"},
      {"t,x,load\n0,1,1\n1,2x,1\n", "hand.csv:3: column x: '2x' is not a number"},
      {"t,x,load\n0,1 2,1\n1,2,1\n", "hand.csv:2: column x: '1 2' is not a number"},
      {"t,x,load\n0,1,1\n1,,1\n", "hand.csv:3: column x: '' is empty: a number is needed"},
      {"t,x,load\n0,nan,1\n1,2,1\n", "hand.csv:2: column x: 'nan' is not finite"},
      {"t,x,load\n0,1,1\n1,inf,1\n", "hand.csv:3: column x: 'inf' is not finite"},
      {"t,x,load\n0,1,1\n1,1e400,1\n", "hand.csv:3: column x: '1e400' is out of the range of a number"},
      {"t,x,load\n0,1,1\n1,-2e6,1\n",
       "hand.csv:3: column x: '-2e6' is -2000000 m; allowed: -1000000 to 1000000"},
      {"t,vx,load\n0,9e5,1\n10,9e5,1\n",
       "hand.csv:3: the velocities lead to 9000000 m; allowed: -1000000 to 1000000"},
      {"t,x,load\n0,1,1\n1,+-1,1\n", "hand.csv:3: column x: '+-1' is not a number"},
      {"t,x,load\n0,1,1\n1,0x10,1\n", "hand.csv:3: column x: '0x10' is not a number"},
      {"t,x,load\n0,1,1\n1,1\n", "hand.csv:3: fewer cells than the header has columns"},
      {"t,x,load\n0,1,1\n1,1,1,1\n", "hand.csv:3: more cells than the header has columns (decimal commas?)"},
      {"t,x,load\n0,1,1\n\n1,1,1\n", "hand.csv:3: fewer cells than the header has columns"},
      {"# one\n# two\nt,x,load\n0,1,1\n# three\n1,?,1\n", "hand.csv:6: column x: '?' is not a number"},
  };
  for (const Case& c : cases) CHECK(refusal(c.text) == c.message);
}

TEST_CASE("Times must ascend strictly", "[motion file]") {
  CHECK(refusal("t,x,load\n0,1,1\n1,1,1\n1,2,1\n") ==
        "hand.csv:4: column t: 1 s does not come after 1 s of the row before");
  CHECK(refusal("t[ms],x,load\n0,1,1\n-1,1,1\n") ==
        "hand.csv:3: column t: -0.001 s does not come after 0 s of the row before");
}

TEST_CASE("A header that does not name what is needed is refused", "[motion file]") {
  CHECK(refusal("") == "hand.csv: empty: expected a header t,x,y,load and rows");
  CHECK(refusal("0,1,1\n1,2,1\n") == "hand.csv:1: names no column of a motion file; expected t,x,y,load");
  CHECK(refusal("t;x;load\n0;1;1\n") == "hand.csv:1: names no column of a motion file; expected t,x,y,load");
  CHECK(refusal("t,y,load\n0,1,1\n") ==
        "hand.csv:1: header 't,y,load' has no column x (nor vx); expected t,x,y,load");
  CHECK(refusal("t,x,x[mm],load\n0,1,1,1\n") == "hand.csv:1: column x appears twice");
  CHECK(refusal("t,x[inch],load\n0,1,1\n") ==
        "hand.csv:1: unit of column x is 'inch'; allowed: m, cm, mm, um, nm");
  CHECK(refusal("t,x[mm,load\n0,1,1\n") ==
        "hand.csv:1: unit of column x is 'mm'; allowed: m, cm, mm, um, nm");
  CHECK(refusal("t,x,vy,load\n0,1,1,1\n") ==
        "hand.csv:1: columns x and vy together: give x and y, or vx and vy");
  CHECK(refusal("t,vx,y,load\n0,1,1,1\n") ==
        "hand.csv:1: columns vx and y together: give x and y, or vx and vy");
}

TEST_CASE("A motion file needs two rows", "[motion file]") {
  CHECK(refusal("t,x,load\n") == "hand.csv: 0 data rows; a motion needs at least 2");
  CHECK(refusal("t,x,load\n0,1,1\n") == "hand.csv: 1 data rows; a motion needs at least 2");
}

TEST_CASE("A zero byte does not hide the rest of a line", "[motion file]") {
  CHECK(refusal(std::string("t,x,load\n0,1,1\n1,2\0,9,1\n", 24)) ==
        "hand.csv:3: a zero byte: not a text file");
}

}  // namespace bristle_test::test_motion_file
