#include "protocol.hpp"

#include <chrono>
#include <cmath>
#include <cstdio>
#include <iostream>
#include <limits>
#include <stdexcept>

static_assert(std::numeric_limits<double>::is_iec559 && sizeof(double) == 8, "the protocol sends IEEE 754 doubles");
static_assert(__BYTE_ORDER__ == __ORDER_LITTLE_ENDIAN__, "the protocol is little-endian: swap the bytes in read and send");

namespace fk {
namespace {

/// A JSON string from UTF-8.
std::string quoted(const std::string& text) {
  std::string json;
  for (const char c : text) {
    char piece[8];
    const bool control = static_cast<unsigned char>(c) < 0x20;
    std::snprintf(piece, sizeof piece, control ? "\\u%04x" : c == '"' || c == '\\' ? "\\%c" : "%c", c);
    json += piece;
  }
  return '"' + json + '"';
}

std::string quoted(const std::vector<std::string>& texts) {
  std::string json;
  for (const std::string& text : texts) json += (json.empty() ? "" : ",") + quoted(text);
  return '[' + json + ']';
}

std::string quoted(const std::map<std::string, std::string>& texts) {
  std::string json;
  for (const auto& [key, text] : texts) json += (json.empty() ? "" : ",") + quoted(key) + ':' + quoted(text);
  return '{' + json + '}';
}

void skip_greeting(std::istream& in) { in.ignore(std::numeric_limits<std::streamsize>::max(), '\n'); }

void read(std::istream& in, double* values, std::size_t count) {
  const auto size = static_cast<std::streamsize>(count * sizeof(double));
  if (!in.read(reinterpret_cast<char*>(values), size))
    throw std::runtime_error("the input ends inside a block: expected " + std::to_string(size) + " bytes, got " +
                             std::to_string(in.gcount()));
}

void send(std::ostream& out, const std::vector<double>& values) {
  out.write(reinterpret_cast<const char*>(values.data()), static_cast<std::streamsize>(values.size() * sizeof(double))).flush();
}

void send_error(std::ostream& out, const std::string& error) { out << R"({"error":)" << quoted(error) << '}' << std::endl; }

/// N, seconds and the N x F row-major placements.
std::vector<double> compute(const Worker& worker, const std::vector<double>& q, std::size_t count) {
  using Clock = std::chrono::steady_clock;
  const std::size_t n = worker.joints.size(), frames = worker.frames.size();
  std::vector<Eigen::Isometry3d> T_base_frame(frames, Eigen::Isometry3d::Identity());
  std::vector<double> block(2 + count * frames * 16);
  double* out = &block[2];
  const auto start = Clock::now();
  for (std::size_t i = 0; i < count; ++i) {
    worker.placements(Eigen::Map<const Eigen::VectorXd>(q.data() + i * n, static_cast<Eigen::Index>(n)), T_base_frame);
    if (T_base_frame.size() != frames) throw std::logic_error("the number of placements has changed");
    for (const Eigen::Isometry3d& T : T_base_frame) {
      Eigen::Map<Eigen::Matrix<double, 4, 4, Eigen::RowMajor>>{out} = T.matrix();
      out += 16;
    }
  }
  block[0] = static_cast<double>(count);
  block[1] = std::chrono::duration<double>(Clock::now() - start).count();
  return block;
}

}  // namespace

int serve(const Worker& worker, std::istream& in, std::ostream& out) {
  try {
    skip_greeting(in);
    out << R"({"protocol":"fk-crosscheck","version":1,"name":)" << quoted(worker.name) << R"(,"joints":)" << quoted(worker.joints)
        << R"(,"frames":)" << quoted(worker.frames) << R"(,"versions":)" << quoted(worker.versions) << '}' << std::endl;
    while (in.peek() != std::istream::traits_type::eof()) {
      double count = 0.0;
      read(in, &count, 1);
      if (!(count >= 1 && count <= 4096 && count == std::floor(count)))  // what follows has no known length
        throw std::runtime_error("expected a block of 1 to 4096 configurations, got " + std::to_string(count));
      std::vector<double> q(static_cast<std::size_t>(count) * worker.joints.size());
      read(in, q.data(), q.size());
      try {
        send(out, compute(worker, q, static_cast<std::size_t>(count)));
      } catch (const std::exception& error) {
        send(out, {-1.0});
        send_error(out, error.what());
      }
      if (!out) throw std::runtime_error("the output is closed");
    }
    return 0;
  } catch (const std::exception& error) {
    std::cerr << worker.name << ": " << error.what() << std::endl;
    return 1;
  }
}

int refuse(const std::string& error, std::istream& in, std::ostream& out) {
  send_error(out, error);
  skip_greeting(in);  // or the harness could not finish writing it
  return 1;
}

}  // namespace fk
