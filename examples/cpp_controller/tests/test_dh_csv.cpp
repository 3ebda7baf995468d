#include <gtest/gtest.h>

#include <cmath>
#include <locale>
#include <sstream>
#include <stdexcept>

#include "dh_csv.hpp"

namespace {

using fk::Convention;
using fk::JointType;

const double PI = std::acos(-1.0);

std::vector<fk::DHJoint> read(const std::string& text) {
  std::istringstream in(text);
  return fk::read_dh_csv(in, "dh.csv", Convention::modified);
}

template <class Function>
std::string error_of(Function function) {
  try {
    function();
  } catch (const std::exception& error) {
    return error.what();
  }
  return "no error";
}

TEST(DHCsv, ReadsColumnsByName) {
  const auto rows = read(
      "# a comment\n"
      "theta, d, type, joint, alpha, a\n"
      "\n"
      "pi/2, 0.1, prismatic, lift, -pi/2, 0.25  # another\n"
      ", , , j2, ,\n"
      ",,,,,\n"
      "0,0,fixed,flange,0,1e-3\n");
  ASSERT_EQ(rows.size(), 3u);
  EXPECT_EQ(rows[0].name, "lift");
  EXPECT_EQ(rows[0].type, JointType::prismatic);
  EXPECT_EQ(rows[0].a, 0.25);
  EXPECT_EQ(rows[0].alpha, -PI / 2);
  EXPECT_EQ(rows[0].d, 0.1);
  EXPECT_EQ(rows[0].theta, PI / 2);
  EXPECT_EQ(rows[0].convention, Convention::modified);
  EXPECT_EQ(rows[1].type, JointType::revolute);
  EXPECT_EQ(rows[1].theta, 0.0);
  EXPECT_EQ(rows[2].type, JointType::fixed);
  EXPECT_EQ(rows[2].a, 1e-3);
}

TEST(DHCsv, ReadsTheHeaderOfArticlesAndWindowsFiles) {
  const auto rows = read("\xEF\xBB\xBFname,a,alpha,d,theta_offset\r\nj1,0,0,0.2,pi\r\n");
  ASSERT_EQ(rows.size(), 1u);
  EXPECT_EQ(rows[0].name, "j1");
  EXPECT_EQ(rows[0].theta, PI);
}

TEST(DHCsv, SaysWhatIsWrongAndWhere) {
  const std::string header = "joint,a,alpha,d,theta\n";
  const std::pair<std::string, std::string> cases[] = {
      {"", "dh.csv:0: expected a header and at least one row, got none"},
      {header + "# nothing\n", "dh.csv:2: expected a header and at least one row, got none"},
      {"joint,a,alfa,d\n", "dh.csv:1: unknown column 'alfa', expected joint,type,a,alpha,d,theta"},
      {"joint,name,a,alpha,d\n", "dh.csv:1: column 'joint' is there twice"},
      {"joint,a,alpha\n", "dh.csv:1: column 'd' is missing"},
      {"# c\n" + header + "j1,0,0,0\n", "dh.csv:3: expected 5 cells, got 4"},
      {header + "j1,0,0,0,0,0\n", "dh.csv:2: expected 5 cells, got 6"},
      {header + ",1,0,0,0\n", "dh.csv:2: expected a joint name, got an empty cell"},
      {header + "\"j1\",1,0,0,0\n", "dh.csv:2: quoted cells are not supported"},
      {header + "j1,0,0,0,0\nj1,0,0,0,0\n", "dh.csv:3: duplicate joint 'j1'"},
      {header + "j1,0,90deg,0,0\n",
       "dh.csv:2: expected a number or a multiple of pi such as pi/2 or 3*pi/4, got '90deg'"},
      {"joint,type,a,alpha,d\nj1,hinge,0,0,0\n",
       "dh.csv:2: unknown joint type 'hinge', expected revolute, prismatic or fixed"}};
  for (const auto& [text, expected] : cases) EXPECT_EQ(error_of([&] { read(text); }), expected);
}

TEST(Numbers, AreDecimalsOrMultiplesOfPi) {
  const std::pair<std::string, double> cases[] = {
      {"0", 0},       {"-0.425", -0.425}, {"+1.5e-3", 1.5e-3}, {".5", 0.5},          {"2.", 2},
      {"pi", PI},     {"-pi/2", -PI / 2}, {"+pi/3", PI / 3},   {"3*pi/4", 3 * PI / 4}, {"-2 * pi / 3", -2 * PI / 3},
      {"10*pi", 10 * PI}};
  for (const auto& [text, expected] : cases) EXPECT_EQ(fk::parse_number(text), expected) << text;
}

TEST(Numbers, AreNothingElse) {
  for (const char* text : {"", "-", "nan", "inf", "1e999", "0x10", "1,5", "1 2", "0.5m", "pi/0", "pi/-2", "0*pi", "1.5*pi",
                           "2pi", "pi*2", "pi/2/2", "--pi", "PI", "pi pi"})
    EXPECT_THROW(fk::parse_number(text), std::invalid_argument) << text;
  EXPECT_THROW(fk::parse_number(std::string(1000000, '7') + "*pi"), std::invalid_argument);
}

struct DecimalComma : std::numpunct<char> {
  char do_decimal_point() const override { return ','; }
};

TEST(Numbers, HaveAPointInEveryLocale) {
  const std::locale before = std::locale::global(std::locale(std::locale(), new DecimalComma));
  EXPECT_EQ(fk::parse_number("0.5"), 0.5);
  EXPECT_THROW(fk::parse_number("0,5"), std::invalid_argument);
  std::locale::global(before);
}

TEST(Pose, IsXyzAndRollPitchYaw) {
  const Eigen::Isometry3d T = fk::parse_pose("1 -2 0.5 pi/6 -pi/3 pi/4");
  const double cr = std::cos(PI / 6), sr = std::sin(PI / 6), cp = std::cos(-PI / 3), sp = std::sin(-PI / 3);
  const double cy = std::cos(PI / 4), sy = std::sin(PI / 4);
  Eigen::Matrix4d expected;
  expected << cy * cp, cy * sp * sr - sy * cr, cy * sp * cr + sy * sr, 1.0,  //
      sy * cp, sy * sp * sr + cy * cr, sy * sp * cr - cy * sr, -2.0,         //
      -sp, cp * sr, cp * cr, 0.5,                                            //
      0, 0, 0, 1;
  EXPECT_LE((T.matrix() - expected).cwiseAbs().maxCoeff(), 1e-15) << T.matrix();
  for (const char* text : {"", "0 0 0 0 0", "0 0 0 0 0 0 0", "0 0 0 0 0 x"})
    EXPECT_THROW(fk::parse_pose(text), std::invalid_argument) << text;
}

}  // namespace
