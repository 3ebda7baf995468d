#include <gtest/gtest.h>

#include <cmath>
#include <random>
#include <stdexcept>

#include "dh.hpp"

namespace {

using Eigen::AngleAxisd;
using Eigen::Isometry3d;
using Eigen::Translation3d;
using Eigen::Vector3d;
using Eigen::VectorXd;
using fk::Convention;
using fk::DHChain;
using fk::DHJoint;
using fk::JointType;
using Placements = std::vector<Isometry3d>;

const double PI = std::acos(-1.0);

/// Published, standard: VnRobo, "Forward Kinematics from Scratch: DH to SE(3) in C++" (2026-06-13).
DHChain ur5() {
  const auto row = [](const char* name, double a, double alpha, double d) {
    return DHJoint{name, JointType::revolute, a, alpha, d, 0.0, Convention::standard};
  };
  DHChain chain;
  chain.rows = {row("shoulder_pan", 0.0, PI / 2, 0.089159), row("shoulder_lift", -0.425, 0.0, 0.0),
                row("elbow", -0.39225, 0.0, 0.0),           row("wrist_1", 0.0, PI / 2, 0.10915),
                row("wrist_2", 0.0, -PI / 2, 0.09465),      row("wrist_3", 0.0, 0.0, 0.0823)};
  return chain;
}

Placements placements(const DHChain& chain, const VectorXd& q) {
  Placements T_base_frame;
  chain.placements(q, T_base_frame);
  return T_base_frame;
}

VectorXd vector(std::initializer_list<double> values) {
  return Eigen::Map<const VectorXd>(values.begin(), static_cast<Eigen::Index>(values.size()));
}

Isometry3d rot_x(double angle) { return Isometry3d(AngleAxisd(angle, Vector3d::UnitX())); }
Isometry3d rot_z(double angle) { return Isometry3d(AngleAxisd(angle, Vector3d::UnitZ())); }
Isometry3d trans(double x, double y, double z) { return Isometry3d(Translation3d(x, y, z)); }

/// The largest difference of two elements is at most `tolerance`, and none is NaN.
void expect_near(const Isometry3d& T, const Isometry3d& expected, double tolerance) {
  const double error = (T.matrix() - expected.matrix()).cwiseAbs().maxCoeff();
  EXPECT_TRUE(T.matrix().allFinite() && error <= tolerance) << "off by " << error << ":\n" << T.matrix() << "\nexpected\n"
                                                             << expected.matrix();
}

/// Every type in every convention, all parameters at random.
std::vector<DHJoint> random_rows(std::mt19937& random, std::size_t count) {
  std::uniform_real_distribution<double> length(-1.0, 1.0), angle(-PI, PI);
  std::vector<DHJoint> rows;
  for (std::size_t i = 0; i < count; ++i)
    rows.push_back({"j" + std::to_string(i), static_cast<JointType>(i % 3), length(random), angle(random), length(random),
                    angle(random), static_cast<Convention>(i / 3 % 2)});
  return rows;
}

TEST(UR5, PublishedPose) {
  const VectorXd q = vector({30, -60, 90, -120, -90, 45}) * PI / 180;
  const double published[][12] = {
      {0.433013, 0.750000, 0.500000, -0.184030, 0.250000, 0.433013, -0.866025, -0.106250, -0.866025, 0.500000, 0, 0.457220},
      {0.750000, -0.433013, 0.500000, -0.478218, 0.433013, -0.250000, -0.866025, -0.276099, 0.500000, 0.866025, 0, 0.261095},
      {0, 0.500000, -0.866025, -0.423643, 0, -0.866025, -0.500000, -0.370626, -1, 0, 0, 0.261095},
      {-0.500000, 0.866025, 0, -0.505612, 0.866025, 0.500000, 0, -0.417951, 0, 0, -1, 0.261095},
      {0.258819, 0.965926, 0, -0.505612, 0.965926, -0.258819, 0, -0.417951, 0, 0, -1, 0.178795}};
  const Placements T_base_frame = placements(ur5(), q);
  for (std::size_t frame = 2; frame <= 6; ++frame) {
    SCOPED_TRACE("frame " + std::to_string(frame));
    Isometry3d expected;
    expected.affine() = Eigen::Map<const Eigen::Matrix<double, 3, 4, Eigen::RowMajor>>(published[frame - 2]);
    expect_near(T_base_frame[frame + 1], expected, 1e-6);
  }
  expect_near(T_base_frame.back(), T_base_frame[7], 0.0);
}

TEST(UR5, IsTheSameArmInModifiedConvention) {
  const DHChain standard = ur5();
  DHChain modified = standard;  // a and alpha move one row down; those of the last row become the tool
  for (std::size_t i = 0; i < 6; ++i) {
    modified.rows[i].convention = Convention::modified;
    modified.rows[i].a = i > 0 ? standard.rows[i - 1].a : 0.0;
    modified.rows[i].alpha = i > 0 ? standard.rows[i - 1].alpha : 0.0;
  }
  modified.T_n_tool = trans(standard.rows[5].a, 0, 0) * rot_x(standard.rows[5].alpha);
  const VectorXd q = vector({0.2, -1.1, 1.4, -0.7, 0.9, -0.3});
  expect_near(placements(modified, q).back(), placements(standard, q).back(), 1e-15);
}

TEST(DHJoint, EqualsItsFourFactors) {
  std::mt19937 random(1);
  std::uniform_real_distribution<double> joint(-PI, PI);
  for (const DHJoint& row : random_rows(random, 600)) {
    const double q = joint(random);
    const Isometry3d z = rot_z(row.theta + (row.type == JointType::revolute ? q : 0.0)) *
                         trans(0, 0, row.d + (row.type == JointType::prismatic ? q : 0.0));
    const Isometry3d x = trans(row.a, 0, 0) * rot_x(row.alpha);
    expect_near(row.transform(q), row.convention == Convention::standard ? z * x : x * z, 1e-14);
  }
}

TEST(DHJoint, ConventionsDiffer) {
  DHJoint row{"j", JointType::revolute, 1.0, PI / 2, 2.0, 0.0, Convention::standard};
  EXPECT_TRUE(row.transform(PI / 2).translation().isApprox(Vector3d(0, 1, 2), 1e-15));
  row.convention = Convention::modified;
  EXPECT_TRUE(row.transform(PI / 2).translation().isApprox(Vector3d(1, -2, 0), 1e-15));
}

TEST(DHJoint, PrismaticSlidesAlongZ) {
  for (const Convention convention : {Convention::standard, Convention::modified}) {
    const DHJoint row{"lift", JointType::prismatic, 0.3, 0.4, 0.5, 0.6, convention};
    const Isometry3d T_0 = row.transform(0.0), T_q = row.transform(0.25);
    const Vector3d axis = convention == Convention::standard ? Vector3d(0, 0, 1) : Vector3d(T_0.linear().col(2));
    EXPECT_TRUE(T_q.translation().isApprox(T_0.translation() + 0.25 * axis, 1e-15));
    EXPECT_EQ(T_q.linear(), T_0.linear());
  }
}

TEST(DHChain, RotationsAreValid) {
  std::mt19937 random(2);
  std::uniform_real_distribution<double> joint(-2 * PI, 2 * PI);
  DHChain mixed;
  mixed.rows = random_rows(random, 12);
  mixed.T_base_0 = rot_x(0.3) * trans(1, 2, 3);
  for (const DHChain& chain : {ur5(), mixed}) {
    VectorXd q(static_cast<Eigen::Index>(chain.joints().size()));
    for (int i = 0; i < 1000; ++i) {
      for (double& value : q) value = joint(random);
      for (const Isometry3d& T : placements(chain, q)) {
        const Eigen::Matrix3d R = T.linear();
        ASSERT_LE((R.transpose() * R - Eigen::Matrix3d::Identity()).cwiseAbs().maxCoeff(), 1e-12) << q.transpose();
        ASSERT_NEAR(R.determinant(), 1.0, 1e-12) << q.transpose();
        ASSERT_EQ(T.matrix().row(3), Eigen::RowVector4d(0, 0, 0, 1));
      }
    }
  }
}

TEST(DHChain, FixedRowsTakeNoJointValue) {
  DHChain chain;
  chain.rows = {{"j1", JointType::revolute, 0.5, 0, 0, 0, Convention::standard},
                {"bracket", JointType::fixed, 0, 0, 0.1, PI, Convention::standard},
                {"j2", JointType::prismatic, 0, 0, 0, 0, Convention::standard}};
  chain.T_base_0 = trans(0, 0, 1);
  chain.T_n_tool = trans(0.2, 0, 0);
  EXPECT_EQ(chain.joints(), (std::vector<std::string>{"j1", "j2"}));
  EXPECT_EQ(chain.frames(), (std::vector<std::string>{"base", "0", "1", "2", "3", "tool"}));
  const Placements T_base_frame = placements(chain, vector({PI / 2, 0.25}));
  const Vector3d origins[] = {{0, 0, 0}, {0, 0, 1}, {0, 0.5, 1}, {0, 0.5, 1.1}, {0, 0.5, 1.35}, {0, 0.3, 1.35}};
  ASSERT_EQ(T_base_frame.size(), std::size(origins));
  for (std::size_t i = 0; i < std::size(origins); ++i)
    EXPECT_LE((T_base_frame[i].translation() - origins[i]).norm(), 1e-15) << "frame " << chain.frames()[i];
}

TEST(DHChain, RefusesWrongJointValues) {
  Placements T_base_frame;
  EXPECT_THROW(ur5().placements(VectorXd::Zero(5), T_base_frame), std::invalid_argument);
  EXPECT_THROW(ur5().placements(VectorXd::Zero(7), T_base_frame), std::invalid_argument);
  EXPECT_THROW(ur5().placements(VectorXd::Constant(6, NAN), T_base_frame), std::invalid_argument);
}

}  // namespace
