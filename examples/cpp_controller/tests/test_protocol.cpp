#include <gtest/gtest.h>

#include <cmath>
#include <sstream>
#include <stdexcept>

#include "protocol.hpp"

namespace {

const std::string GREETING = "{\"protocol\":\"fk-crosscheck\",\"version\":1}\n";

/// One joint that slides along x; refuses negative values.
fk::Worker slider(const std::string& joint = "x") {
  return {"slider", {joint}, {"base", "tool"}, {{"slider", "1.0"}}, [](const auto& q, auto& T_base_frame) {
            if (q[0] < 0.0) throw std::runtime_error("x is \"negative\"");
            T_base_frame[1].translation().x() = q[0];
          }};
}

std::string bytes(const std::vector<double>& values) {
  return std::string(reinterpret_cast<const char*>(values.data()), values.size() * sizeof(double));
}

struct Session {
  int exit_code;
  std::string line, rest;

  Session(const fk::Worker& worker, const std::string& input) {
    std::istringstream in(input);
    std::ostringstream out;
    exit_code = fk::serve(worker, in, out);
    std::istringstream answers(out.str());
    std::getline(answers, line);
    rest = out.str().substr(line.size() + 1);
  }
};

TEST(Protocol, AnswersTheGreeting) {
  const Session session(slider("a\"b\\c\n\x01"), GREETING);
  EXPECT_EQ(session.line,
            R"({"protocol":"fk-crosscheck","version":1,"name":"slider","joints":["a\"b\\c\u000a\u0001"],)"
            R"("frames":["base","tool"],"versions":{"slider":"1.0"}})");
  EXPECT_EQ(session.rest, "");
  EXPECT_EQ(session.exit_code, 0);
}

TEST(Protocol, AnswersBlocksInRowMajorOrder) {
  Session session(slider(), GREETING + bytes({2, 0.25, 0.5, 1, 0.75}));
  ASSERT_EQ(session.rest.size(), (2 + 2 * 2 * 16 + 2 + 1 * 2 * 16) * sizeof(double));
  std::vector<double> values(session.rest.size() / sizeof(double));
  session.rest.copy(reinterpret_cast<char*>(values.data()), session.rest.size());
  const auto expect_block = [](const double* block, const std::vector<double>& xs) {
    EXPECT_EQ(block[0], static_cast<double>(xs.size()));
    EXPECT_GE(block[1], 0.0);
    block += 2;
    for (const double x : xs) {
      EXPECT_EQ(std::vector<double>(block, block + 16), (std::vector<double>{1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1}));
      EXPECT_EQ(std::vector<double>(block + 16, block + 32),
                (std::vector<double>{1, 0, 0, x, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1}));
      block += 32;
    }
  };
  expect_block(values.data(), {0.25, 0.5});
  expect_block(values.data() + 2 + 2 * 2 * 16, {0.75});
  EXPECT_EQ(session.exit_code, 0);
}

TEST(Protocol, RefusesABlockAndGoesOn) {
  const Session session(slider(), GREETING + bytes({2, 0.5, -0.5, 1, 0.75}));
  const std::string refusal = bytes({-1}) + "{\"error\":\"x is \\\"negative\\\"\"}\n";
  EXPECT_EQ(session.rest.substr(0, refusal.size()), refusal);
  EXPECT_EQ(session.rest.size(), refusal.size() + (2 + 2 * 16) * sizeof(double));
  EXPECT_EQ(session.exit_code, 0);
}

TEST(Protocol, FailsOnWrongBlockSizes) {
  for (const double count : {0.0, -1.0, 1.5, 4097.0, 1e300, std::nan("")}) {
    std::vector<double> block(count > 1.0 && count < 1e4 ? 1 + static_cast<std::size_t>(count) : 1, 0.5);
    block[0] = count;
    EXPECT_EQ(Session(slider(), GREETING + bytes(block)).exit_code, 1) << count;
  }
}

TEST(Protocol, FailsWhenTheInputEndsInsideABlock) {
  const std::string block = bytes({2, 0.25, 0.5});
  EXPECT_EQ(Session(slider(), GREETING + block).exit_code, 0);
  for (std::size_t size = 1; size < block.size(); ++size)
    EXPECT_EQ(Session(slider(), GREETING + block.substr(0, size)).exit_code, 1) << size;
}

TEST(Protocol, RefusesADescription) {
  std::istringstream in(GREETING);
  std::ostringstream out;
  EXPECT_EQ(fk::refuse("dh.csv:2: no", in, out), 1);
  EXPECT_EQ(out.str(), "{\"error\":\"dh.csv:2: no\"}\n");
}

}  // namespace
