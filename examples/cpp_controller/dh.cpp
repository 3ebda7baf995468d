#include "dh.hpp"

#include <algorithm>
#include <cmath>
#include <stdexcept>

namespace fk {

Eigen::Isometry3d DHJoint::transform(double q) const {
  const double angle = type == JointType::revolute ? theta + q : theta;
  const double distance = type == JointType::prismatic ? d + q : d;
  const double ct = std::cos(angle), st = std::sin(angle);
  const double ca = std::cos(alpha), sa = std::sin(alpha);
  Eigen::Isometry3d T;
  if (convention == Convention::standard) {
    T.matrix() << ct, -st * ca,  st * sa, a * ct,
                  st,  ct * ca, -ct * sa, a * st,
                  0.0,      sa,       ca, distance,
                  0.0,     0.0,      0.0, 1.0;
  } else {
    T.matrix() <<      ct,     -st, 0.0, a,
                  st * ca, ct * ca, -sa, -sa * distance,
                  st * sa, ct * sa,  ca,  ca * distance,
                      0.0,     0.0, 0.0, 1.0;
  }
  return T;
}

std::vector<std::string> DHChain::joints() const {
  std::vector<std::string> names;
  for (const DHJoint& row : rows)
    if (row.type != JointType::fixed) names.push_back(row.name);
  return names;
}

std::vector<std::string> DHChain::frames() const {
  std::vector<std::string> labels{"base"};
  for (std::size_t i = 0; i <= rows.size(); ++i) labels.push_back(std::to_string(i));
  labels.push_back("tool");
  return labels;
}

void DHChain::placements(const Eigen::Ref<const Eigen::VectorXd>& q, std::vector<Eigen::Isometry3d>& T_base_frame) const {
  const auto moves = [](const DHJoint& row) { return row.type != JointType::fixed; };
  const Eigen::Index n = std::count_if(rows.begin(), rows.end(), moves);
  if (q.size() != n)
    throw std::invalid_argument("expected " + std::to_string(n) + " joint values, got " + std::to_string(q.size()));
  if (!q.allFinite()) throw std::invalid_argument("a joint value is not finite");

  T_base_frame.resize(rows.size() + 3);
  T_base_frame[0].setIdentity();
  T_base_frame[1] = T_base_0;
  Eigen::Index joint = 0;
  for (std::size_t i = 0; i < rows.size(); ++i)
    T_base_frame[i + 2] = T_base_frame[i + 1] * rows[i].transform(moves(rows[i]) ? q[joint++] : 0.0);
  T_base_frame.back() = T_base_frame[rows.size() + 1] * T_n_tool;
}

}  // namespace fk
