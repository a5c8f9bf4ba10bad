// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Geometry>

#include "correspondence.hpp"
#include "network/cholesky_factor.hpp"
#include "network/dense_layer.hpp"

namespace unirit {

/// What the refinement estimates: p -> pose * (p + displacement(p)). The clouds' unit.
struct CoherentState {
  Eigen::Isometry3f pose = Eigen::Isometry3f::Identity();
  Eigen::Matrix3Xf coefficients;  ///< 3 x rank, of the prior's functions
  Points displacements;           ///< 3 x N, at the source's points
};

/// Standard deviations of the pose about the start, before anything is seen.
struct PosePrior {
  float rotation = 0.1F;      ///< of the rotation vector, per axis [radian]
  float translation = 0.05F;  ///< per axis
};

/// How far a correspondence is trusted along the target's normal and across it.
struct Trust {
  float along = 0.1F;   ///< standard deviation
  float across = 0.1F;  ///< standard deviation
  float weight = 1.0F;  ///< of one point: neighbours are no independent measurements
};

/// The maximisation step: displacement and pose that best explain the correspondences under their
/// priors, a linear least-squares problem in 3 rank + 6 unknowns. The rotation is linearised about
/// the present pose; the pose's own deviations are estimated with it (empirical Bayes).
class CoherentSolver {
 public:
  /// `functions`: rank x N, the prior's at the source's points. `kernels`, `team` must outlive it.
  CoherentSolver(const Points& source, const Eigen::MatrixXf& functions, const PosePrior& prior,
                 const Kernels& kernels, ThreadTeam& team);

  Eigen::Index rank() const { return functions_.rows(); }

  /// Moves the pose alone; the displacement stays as it is.
  void solvePose(const Correspondences& correspondences, const Trust& trust, CoherentState& state);

  /// Moves pose and displacement, `stride` times as far as the least squares lie.
  void solve(const Correspondences& correspondences, const Trust& trust, CoherentState& state,
             float stride = 1.0F);

  /// Makes the displacements those of the coefficients.
  void displace(CoherentState& state);

  /// Forgets what was learnt of the pose's deviations, begins anew from these.
  void restart(const PosePrior& prior) { prior_ = deviations_ = prior; }

  /// After solve: F such that the coefficients of axis a have the covariance F_a^T F_a, where F_a
  /// are the columns from a * rank on; (3 rank + 6) x 3 rank.
  void covarianceFactor(Eigen::MatrixXf& factor) const;

 private:
  static constexpr Eigen::Index kPose = 6;  // rotation vector, translation
  using RowMajor = Eigen::Matrix<float, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;
  /// A number of every point a row, for the processor's vectors.
  template <int Rows>
  using PointRows = Eigen::Array<float, Rows, Eigen::Dynamic, Eigen::RowMajor>;

  void weigh(const Correspondences& correspondences, const Trust& trust, const CoherentState& state,
             const PointRows<3>& reference);
  void weighPose();
  Eigen::Index poseRow(int axis, int column) const { return 6 * rank() + kPose * axis + column; }
  Eigen::Index gradientRow(int axis) const { return poseRow(3, axis); }
  long panelsOf(long first, long end) const;
  void multiply();
  void assemble();
  void addPosePrior(const CoherentState& state, Eigen::Index first);
  void movePose(Eigen::Index first, CoherentState& state) const;
  void learnDeviations(const CoherentState& state);

  PointRows<3> source_;
  RowMajor functions_;  // rank x N
  PosePrior prior_;
  PosePrior deviations_;  // as learnt
  const Kernels& kernels_;
  ThreadTeam& team_;
  DenseLayer product_;       // multiplies rows of N by the functions
  DenseLayer displacement_;  // multiplies rows of coefficients by the functions
  RowMajor rows_;      // (6 rank + 21) x N: weighted functions, weighted pose columns, gradient
  RowMajor products_;  // (6 rank + 21) x padded rank
  PointRows<6> information_;  // xx xy xz yy yz zz of each point, in the source's frame
  PointRows<3> moved_;
  PointRows<3> normals_;  // in the source's frame, as the next
  PointRows<3> residuals_;
  PointRows<1> weights_;
  RowMajor coefficients_;
  RowMajor displaced_;  // 3 x padded N
  Eigen::Matrix<float, kPose, kPose> pose_matrix_;
  Eigen::Matrix<float, kPose, 1> pose_gradient_;
  Eigen::MatrixXf matrix_;  // normal equations
  Eigen::VectorXf unknowns_;
  CholeskyFactor factor_;
};

}  // namespace unirit
