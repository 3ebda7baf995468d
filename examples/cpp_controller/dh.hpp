// Forward kinematics of a serial chain in Denavit-Hartenberg parameters. Metres and radians; T_a_b is frame b in frame a.
#pragma once

#include <Eigen/Geometry>
#include <string>
#include <vector>

namespace fk {

enum class Convention { standard, modified };
enum class JointType { revolute, prismatic, fixed };

/// One row of a DH table: a, d [m], alpha, theta [rad]. theta (d, if prismatic) is the offset added to q.
struct DHJoint {
  std::string name;
  JointType type = JointType::revolute;
  double a = 0.0, alpha = 0.0, d = 0.0, theta = 0.0;
  Convention convention = Convention::standard;

  /// This row's frame in the one before it, for q [rad; m if prismatic; ignored if fixed].
  ///   standard (Denavit & Hartenberg 1955): Rz(theta) Tz(d) Tx(a) Rx(alpha)
  ///   modified (Craig, eq. 3.6):            Rx(alpha) Tx(a) Rz(theta) Tz(d), a and alpha of the previous link
  Eigen::Isometry3d transform(double q) const;
};

/// T_base_tool = T_base_0 A_1 ... A_n T_n_tool
struct DHChain {
  std::vector<DHJoint> rows;
  Eigen::Isometry3d T_base_0 = Eigen::Isometry3d::Identity();
  Eigen::Isometry3d T_n_tool = Eigen::Isometry3d::Identity();

  /// Names of the rows that move: the order of q.
  std::vector<std::string> joints() const;

  /// "base", "0" (after T_base_0), "1" ... "n" (after each row, fixed ones included), "tool".
  std::vector<std::string> frames() const;

  /// Placement of every frame, in the order of `frames()`; allocates only if T_base_frame has another size.
  /// Throws std::invalid_argument if q has the wrong size or a value that is not finite.
  void placements(const Eigen::Ref<const Eigen::VectorXd>& q, std::vector<Eigen::Isometry3d>& T_base_frame) const;
};

}  // namespace fk
