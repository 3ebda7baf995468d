// Reads a DH table and the numbers in it. Text is UTF-8; a decimal point is a point whatever the locale.
#pragma once

#include <iosfwd>
#include <string>
#include <vector>

#include "dh.hpp"

namespace fk {

/// A finite number, or a multiple of pi such as `pi`, `-pi/2`, `3*pi/4`. Throws std::invalid_argument.
double parse_number(const std::string& text);

/// `x y z roll pitch yaw` [m, rad] with R = Rz(yaw) Ry(pitch) Rx(roll). Throws std::invalid_argument.
Eigen::Isometry3d parse_pose(const std::string& text);

/// Rows of a table with the header `joint,type,a,alpha,d,theta`, columns in any order; `name` and `theta_offset` are
/// understood too. `#` starts a comment, an empty cell is zero, a row without a type is revolute.
/// Throws std::runtime_error starting with `where:line:`.
std::vector<DHJoint> read_dh_csv(std::istream& in, const std::string& where, Convention convention);

}  // namespace fk
