// SPDX-License-Identifier: BSD-3-Clause
#include "allocation_counter.hpp"
#include "unirit/evaluation/pair.hpp"
#include "unirit/registration.hpp"
#include "unirit/simulation/phantom.hpp"

namespace unirit {
namespace {

using test::countAllocations;

/// What a call hands over (the deformation, checks, stage times) and what looking at its cloud
/// takes (samples, neighbours, normals); the search from a near start takes nothing, see
/// refinement_test.
constexpr long kOfACall = 310;
constexpr double kTreeVaries = 10;  // k-d trees take as many blocks as their points call for

class RegistrationAllocation : public testing::Test {
 protected:
  void SetUp() override { test::requireCounting(); }

  static RegistrationSettings settings(int threads) {
    RegistrationSettings settings;
    settings.threads = threads;
    settings.stages = {Stage::kRefine};
    return settings;
  }

  /// Of a call after the first two, from a cold or warm start.
  long inSteadyState(const RegistrationSettings& settings, bool warm) const {
    static const auto weights =
        std::make_shared<const Weights>(randomWeights(NetworkSettings().pairing, 1));
    Registrar registrar(weights, settings);
    Registration registration;
    const auto registerClouds = [&] {
      const Eigen::Isometry3d start = registration.T_intraoperative_preoperative;
      const Earlier earlier{start, registration.deformation, registration.next_fit};
      registration = registrar.registerClouds(organ_, seen_, start,
                                              warm && earlier.deformation ? &earlier : nullptr);
    };
    const long first = countAllocations(registerClouds);
    countAllocations(registerClouds);
    const long later = countAllocations(registerClouds);
    EXPECT_LT(later, first) << "the first call sizes the buffers and samples the organ";
    EXPECT_TRUE(registration.deformation) << registration.message;
    EXPECT_NEAR(countAllocations(registerClouds), later, kTreeVaries);
    return later;
  }

  const RegistrationPair pair_ =
      makePair(makePhantom("liver", 1, 3000), Protocol::kPartial, 1024, 1);
  const PointCloud organ_{pair_.source, pair_.source_normals};
  const PointCloud seen_{pair_.target, {}, pair_.viewpoint};
};

TEST_F(RegistrationAllocation, OfACallAfterTheFirstIsBounded) {
  for (const int threads : {1, 2}) {
    for (const bool warm : {false, true}) {
      const long count = inSteadyState(settings(threads), warm);
      RecordProperty("allocations", static_cast<int>(count));
      std::printf("%d threads, %s: %ld allocations\n", threads, warm ? "warm" : "cold", count);
      EXPECT_LT(count, kOfACall);
    }
  }
}

TEST_F(RegistrationAllocation, DoesNotGrowWithTheIterations) {
  RegistrationSettings few = settings(1), many = settings(1);
  few.refinement.iterations = 10;
  many.refinement.iterations = 40;
  const long more = inSteadyState(many, false) - inSteadyState(few, false);
  EXPECT_NEAR(more, 0, kTreeVaries) << "of 30 further iterations";
}

}  // namespace
}  // namespace unirit
