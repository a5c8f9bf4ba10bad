// SPDX-License-Identifier: BSD-3-Clause
#include <dynamic_reconfigure/Reconfigure.h>

#include <atomic>
#include <thread>

#include "conversions.hpp"
#include "names.hpp"
#include "node_fixture.hpp"

namespace unirit::test {
namespace {

void setThreshold(const std::string& name, double value) {
  dynamic_reconfigure::Reconfigure change;
  change.request.config.doubles.resize(1);
  change.request.config.doubles[0].name = name;
  change.request.config.doubles[0].value = value;
  const std::string node = ros::param::param<std::string>("~node", "/unirit");
  ASSERT_TRUE(callService(node + "/plausibility/set_parameters", change));
}

/// Restores a threshold when the test ends.
class Threshold {
 public:
  Threshold(const std::string& name, double value, double usual) : name_(name), usual_(usual) {
    setThreshold(name, value);
  }
  ~Threshold() { setThreshold(name_, usual_); }

 private:
  std::string name_;
  double usual_;
};

TEST_F(Node, resultTellsAllThereIsToKnow) {
  const RegistrationResult& result = accepted_.result;
  EXPECT_GE(result.id, 1U);
  EXPECT_EQ(result.header.frame_id, kCameraFrame);
  EXPECT_EQ(result.preoperative_frame, kOrganFrame);
  EXPECT_EQ(result.start, "initial guess");
  EXPECT_EQ(result.weights_sha256.size(), 64U);
  EXPECT_EQ(result.settings_sha256.size(), 64U);
  EXPECT_FALSE(result.checks.empty());
  EXPECT_EQ(result.stages.size(), result.stage_milliseconds.size());
  EXPECT_EQ(result.stages.front(), "conversion");
  EXPECT_GT(result.residual_rms, 0.0);
  EXPECT_GE(result.residual_p95, result.residual_median);
  EXPECT_GT(result.displacement_max, 0.0);
  EXPECT_GT(result.coverage, 0.0);
  const auto& q = result.transform.rotation;
  EXPECT_NEAR(q.x * q.x + q.y * q.y + q.z * q.z + q.w * q.w, 1.0, 1e-12);
}

TEST_F(Node, topicsCarryWhatTheServiceAnswered) {
  const RegistrationResult& result = accepted_.result;
  const auto published =
      client().waitForResult([&](const auto& other) { return other.id == result.id; });
  EXPECT_EQ(published.header.stamp, result.header.stamp);
  EXPECT_EQ(published.residual_rms, result.residual_rms);
  ASSERT_TRUE(waitForClouds());
  client().look([&] {
    EXPECT_EQ(client().deformed.header.frame_id, kCameraFrame);
    EXPECT_EQ(pointsOf(client().rigid).cols(), organ().cols());
  });
}

TEST_F(Node, deformedIsRigidPlusItsDisplacement) {
  ASSERT_TRUE(waitForClouds());
  client().look([&] {
    const Points deformed = pointsOf(client().deformed), rigid = pointsOf(client().rigid);
    ASSERT_EQ(deformed.cols(), rigid.cols());
    const Eigen::RowVectorXf displacements = valuesOf(client().deformed, "displacement");
    EXPECT_LT((displacements - (deformed - rigid).colwise().norm()).cwiseAbs().maxCoeff(), 1e-6F);
  });
}

TEST_F(Node, deformedIsSurestOfWhatTheCameraSaw) {
  ASSERT_TRUE(waitForClouds());
  client().look([&] {
    const Eigen::RowVectorXf confidence = valuesOf(client().deformed, "confidence");
    ASSERT_EQ(confidence.size(), organ().cols());
    EXPECT_GE(confidence.minCoeff(), 0.0F);
    EXPECT_LE(confidence.maxCoeff(), 1.0F);
    const Points deformed = pointsOf(client().deformed);
    Eigen::Index nearest = 0, farthest = 0;
    deformed.row(2).minCoeff(&nearest);
    deformed.row(2).maxCoeff(&farthest);
    EXPECT_GT(confidence[nearest], confidence[farthest] + 0.1F);
    EXPECT_EQ(fieldIndex(client().rigid, "confidence"), -1);
  });
}

TEST_F(Node, broadcastsOneEdgeWithAdvancingStamps) {
  const auto ours = [](const auto& transform) {
    return transform.header.frame_id == kCameraFrame && transform.child_frame_id == kOrganFrame;
  };
  const ros::Time now = ros::Time::now();
  ASSERT_TRUE(client().waitUntil([&] {
    return std::count_if(client().transforms.begin(), client().transforms.end(),
                         [&](const auto& t) { return ours(t) && t.header.stamp > now; }) >= 3;
  }));
  client().look([&] {
    geometry_msgs::TransformStamped last;
    for (const auto& transform : client().transforms) {
      if (!ours(transform)) continue;
      EXPECT_GT(transform.header.stamp, last.header.stamp);
      last = transform;
    }
    EXPECT_TRUE(poseOf(last.transform).isApprox(poseOf(accepted_.result.transform), 1e-9));
  });
}

TEST_F(Node, guessOnTheTopicIsUsedOnceAndThenTheAcceptedPose) {
  client().sendGuess(kCameraFrame, truePose());
  client().registerUntil([](const auto& result) { return result.start == names::kStartGuess; });
  EXPECT_EQ(client().callRegister().result.start, names::kStartAccepted);
}

TEST_F(Node, ownCloudsTouchNothing) {
  const Eigen::Isometry3d moved = Eigen::Translation3d(0.1, 0.0, 0.0) * truePose();
  RegisterRequest request = requestFrom(moved);
  request.intraoperative = seenCloud(moved, ros::Time(7.0));
  const RegisterResponse own = client().callRegister(request);
  ASSERT_EQ(own.result.status, RegistrationResult::SUCCEEDED) << own.result.message;
  EXPECT_EQ(own.result.header.stamp, ros::Time(7.0));
  EXPECT_EQ(pointsOf(own.deformed).cols(), organ().cols());
  const auto later = client().callRegister();
  client().waitForResult([&](const auto& result) { return result.id == later.result.id; });
  client().look([&] {
    for (const auto& result : client().results) EXPECT_NE(result.id, own.result.id);
  });
  EXPECT_EQ(later.result.id, own.result.id + 1);
}

TEST_F(Node, deformPointsMovesTheSurfaceAsPublished) {
  const auto answer = client().callDeformPoints(kOrganFrame, organ());
  ASSERT_EQ(answer.status, RegistrationResult::SUCCEEDED) << answer.message;
  EXPECT_EQ(answer.registration_id, accepted_.result.id);
  EXPECT_EQ(answer.header.frame_id, kCameraFrame);
  EXPECT_GE(answer.age.toSec(), 0.0);
  const Points deformed = pointsOf(accepted_.deformed);
  ASSERT_EQ(answer.points.size(), static_cast<std::size_t>(deformed.cols()));
  for (std::size_t i = 0; i < answer.points.size(); ++i) {
    const auto& p = answer.points[i];
    const Eigen::Vector3f expected = deformed.col(static_cast<Eigen::Index>(i));
    EXPECT_LT((Eigen::Vector3d(p.x, p.y, p.z) - expected.cast<double>()).norm(), 1e-6);
  }
}

TEST_F(Node, deformPointsIsAsSureAsTheCloudAndNotOfWhatIsFar) {
  Points points(3, organ().cols() + 1);
  points << organ(), Eigen::Vector3f(0.0F, 0.0F, 5.0F);
  const auto answer = client().callDeformPoints(kOrganFrame, points);
  const Eigen::RowVectorXf published = valuesOf(accepted_.deformed, "confidence");
  ASSERT_EQ(answer.confidence.size(), static_cast<std::size_t>(points.cols()));
  for (Eigen::Index i = 0; i < published.size(); ++i) {
    EXPECT_NEAR(answer.confidence[static_cast<std::size_t>(i)], published[i], 1e-4);
  }
  EXPECT_LT(answer.confidence.back(), 1e-3);
}

TEST_F(Node, deformPointsRefusesOtherFramesAndPointsThatAreNotFinite) {
  const auto elsewhere = client().callDeformPoints(kCameraFrame, organ());
  EXPECT_EQ(elsewhere.status, RegistrationResult::INVALID_INPUT);
  EXPECT_TRUE(names(elsewhere.message, "'camera'") && names(elsewhere.message, "'organ'"));
  Points broken = organ().leftCols(3);
  broken(1, 2) = std::numeric_limits<float>::quiet_NaN();
  const auto answer = client().callDeformPoints(kOrganFrame, broken);
  EXPECT_EQ(answer.status, RegistrationResult::INVALID_INPUT);
  EXPECT_TRUE(names(answer.message, "point 2"));
  EXPECT_TRUE(answer.points.empty());
}

TEST_F(Node, refusedRegistrationLeavesTheLastGoodOneAndShowsItsCloud) {
  const Threshold strict("max_residual", 0.0, 0.06);
  const auto response = client().callRegister();
  EXPECT_EQ(response.result.status, RegistrationResult::REFUSED);
  EXPECT_TRUE(names(response.result.message, "surface residual")) << response.result.message;
  EXPECT_EQ(pointsOf(response.deformed).cols(), organ().cols());
  EXPECT_TRUE(client().waitUntil(
      [&] { return client().refused.header.stamp == response.result.header.stamp; }));
  EXPECT_TRUE(waitForClouds());
  const auto answer = client().callDeformPoints(kOrganFrame, organ());
  EXPECT_EQ(answer.registration_id, accepted_.result.id);
}

TEST_F(Node, poseThatJumpsFromTheAcceptedOneIsRefusedUnlessGuessed) {
  const Threshold strict("max_jump_translation", 0.0, 0.1);
  const auto jumped = client().callRegister();
  EXPECT_EQ(jumped.result.start, names::kStartAccepted);
  EXPECT_EQ(jumped.result.status, RegistrationResult::REFUSED);
  EXPECT_TRUE(names(jumped.result.message, "jump in translation")) << jumped.result.message;
  const auto guessed = client().callRegister(requestFrom(truePose()));
  EXPECT_EQ(guessed.result.status, RegistrationResult::SUCCEEDED) << guessed.result.message;
}

TEST_F(Node, settingsHashFollowsTheThresholds) {
  const Threshold wider("max_jump_rotation", 180.0, 60.0);
  EXPECT_NE(client().callRegister().result.settings_sha256, accepted_.result.settings_sha256);
}

TEST_F(Node, anotherOrganWithdrawsTheRegistration) {
  ASSERT_TRUE(waitForClouds());
  client().sendOrgan(message(organ(), "another_organ", ros::Time(2.0)));
  EXPECT_TRUE(
      client().waitUntil([] { return client().deformed.width == 0 && client().rigid.width == 0; }));
  const auto answer = client().callDeformPoints(kOrganFrame, organ());
  EXPECT_EQ(answer.status, RegistrationResult::REFUSED);
  EXPECT_EQ(answer.registration_id, 0U);
}

TEST_F(Node, otherServicesAnswerWhileARegistrationRuns) {
  const auto crowd = message(Points(truePose().cast<float>() * organ(400000)), kCameraFrame, {});
  std::atomic<bool> running{true};
  std::thread registering([&] {
    EXPECT_EQ(client().callRegister(requestWith(organCloud(), crowd)).result.status,
              RegistrationResult::SUCCEEDED);
    running = false;
  });
  int answered = 0;
  while (running) {
    client().callDeformPoints(kOrganFrame, organ(10));
    if (running) ++answered;
  }
  registering.join();
  EXPECT_GT(answered, 0);
}

}  // namespace
}  // namespace unirit::test
