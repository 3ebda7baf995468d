// The worker's side of the fk-crosscheck worker protocol, version 1. Copy it as it is.
#pragma once

#include <Eigen/Geometry>
#include <functional>
#include <iosfwd>
#include <map>
#include <string>
#include <vector>

namespace fk {

/// What the harness sees of a controller.
struct Worker {
  std::string name;
  std::vector<std::string> joints;              // in the order of q, named as in the DH table
  std::vector<std::string> frames;              // "base", "0", "1" ... "n", "tool"
  std::map<std::string, std::string> versions;  // of the libraries that matter, for the report

  /// Writes the placement [m] of each frame, in the order of `frames`, for one configuration q [rad, m].
  /// T_base_frame has one element a frame, identity at first. An exception refuses the whole block; the next is served.
  std::function<void(const Eigen::Ref<const Eigen::VectorXd>& q, std::vector<Eigen::Isometry3d>& T_base_frame)> placements;
};

/// Answers the greeting, then every block of configurations until the input ends. Returns the exit code.
int serve(const Worker& worker, std::istream& in, std::ostream& out);

/// Answers the greeting with an error: there is nothing to serve. Returns the exit code.
int refuse(const std::string& error, std::istream& in, std::ostream& out);

}  // namespace fk
