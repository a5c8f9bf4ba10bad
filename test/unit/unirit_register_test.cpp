// SPDX-License-Identifier: BSD-3-Clause
// What unirit_register writes.
#include <set>

#include "register_tool.hpp"
#include "unirit/hash.hpp"

namespace unirit {
namespace {

TEST_F(RegisterTool, KeepsEveryVertexInOrderAndTheFaces) {
  ASSERT_EQ(run(kUsual), 0) << contents(at("stderr"));
  EXPECT_TRUE(contents(at("stderr")).empty());
  const Surface organ = readSurface(at("organ.ply"), kMillimetre).surface;
  const Surface rigid = readSurface(at("out/rigid.ply"), kMillimetre).surface;
  const Surface deformed = readSurface(at("out/deformed.ply"), kMillimetre).surface;
  EXPECT_EQ(rigid.faces, organ.faces);
  EXPECT_EQ(deformed.faces, organ.faces);
  ASSERT_EQ(deformed.vertices.size(), organ.vertices.size());
  EXPECT_GT((deformed.vertices.points - rigid.vertices.points).colwise().norm().maxCoeff(), 1e-6F);

  const auto transform = result().at("transform");
  const auto t = transform.at("translation").get<std::vector<double>>();
  const auto q = transform.at("rotation").get<std::vector<double>>();
  const Eigen::Isometry3d pose =
      Eigen::Translation3d(t[0], t[1], t[2]) * Eigen::Quaterniond(q[3], q[0], q[1], q[2]);
  const Points expected = (pose * organ.vertices.points.cast<double>()).cast<float>();
  EXPECT_LT((rigid.vertices.points - expected).cwiseAbs().maxCoeff(), 1e-6F);
  EXPECT_GT(t[2], 0.2) << "the camera stood some 0.37 m away";
}

TEST_F(RegisterTool, ResultHasTheMessagesFieldsInMetres) {
  ASSERT_EQ(run(kUsual), 0);
  const nlohmann::json json = result();
  const std::set<std::string> names{"header",
                                    "id",
                                    "status",
                                    "message",
                                    "start",
                                    "transform",
                                    "residual_rms",
                                    "residual_median",
                                    "residual_p95",
                                    "coverage",
                                    "inlier_fraction",
                                    "inlier_tolerance",
                                    "checks",
                                    "stages",
                                    "displacement_rms",
                                    "displacement_p95",
                                    "folded_fraction",
                                    "settings_sha256",
                                    "displacement_max",
                                    "stage_milliseconds",
                                    "weights_sha256",
                                    "preoperative_frame",
                                    "preprocessing_stages",
                                    "preprocessing_points"};
  std::set<std::string> found;
  for (const auto& [name, value] : json.items()) found.insert(name);
  EXPECT_EQ(found, names);
  EXPECT_EQ(json["header"]["frame_id"], "seen.ply");
  EXPECT_EQ(json["preoperative_frame"], "organ.ply");
  EXPECT_EQ(json["start"], "centroids");
  EXPECT_EQ(json["status"], 0);
  EXPECT_EQ(json["inlier_tolerance"], 0.005);
  EXPECT_GT(json["residual_rms"].get<double>(), 1e-4);
  EXPECT_LT(json["residual_rms"].get<double>(), 0.05);
  EXPECT_EQ(json["weights_sha256"], sha256Hex(contents(at("weights.safetensors"))));
  EXPECT_EQ(json["stages"].size(), json["stage_milliseconds"].size());
  EXPECT_FALSE(json["checks"].empty());
}

TEST_F(RegisterTool, MovesFurtherPointsWithTheOrgan) {
  ASSERT_EQ(run(std::string(kUsual) + "--points organ.ply"), 0);
  EXPECT_LT((points("points.ply") - points("deformed.ply")).cwiseAbs().maxCoeff(), 1e-6F);
  ASSERT_EQ(run(std::string(kUsual) + "--output out/without"), 2) << "an option given twice";
}

TEST_F(RegisterTool, GivesTheSameBitsForAnyNumberOfThreads) {
  ASSERT_EQ(run(std::string(kUsual) + "--threads 1"), 0);
  const std::string once = contents(at("out/deformed.ply"));
  ASSERT_EQ(run(std::string(kUsual) + "--threads 3"), 0);
  EXPECT_EQ(contents(at("out/deformed.ply")), once);
}

TEST_F(RegisterTool, RigidStageAloneDoesNotDeform) {
  ASSERT_EQ(run(std::string(kUsual) + "--stages rigid"), 0);
  EXPECT_LT((points("deformed.ply") - points("rigid.ply")).cwiseAbs().maxCoeff(), 1e-7F);
}

TEST_F(RegisterTool, RunsTheStagesThatItIsTold) {
  const auto ran = [](const char* stage) {
    const auto stages = result().at("stages").get<std::vector<std::string>>();
    return std::count(stages.begin(), stages.end(), stage) == 1;
  };
  ASSERT_EQ(run(kUsual), 0);
  EXPECT_TRUE(ran("rigid") && !ran("nonrigid") && ran("refine"));  // which displaces by itself
  ASSERT_EQ(run(std::string(kUsual) + "--stages rigid,refine"), 0) << contents(at("stderr"));
  EXPECT_TRUE(ran("rigid") && !ran("nonrigid") && ran("refine"));
  ASSERT_EQ(run(std::string(kUsual) + "--stages refine"), 0) << contents(at("stderr"));
  EXPECT_TRUE(!ran("rigid") && ran("refine"));
  ASSERT_EQ(run(std::string(kUsual) + "--stages rigid,nonrigid"), 0);
  EXPECT_TRUE(ran("rigid") && ran("nonrigid") && !ran("refine"));
}

TEST_F(RegisterTool, RefinementBringsTheOrganToTheCloud) {
  ASSERT_EQ(run(std::string(kUsual) + "--stages rigid,nonrigid"), 0);
  const double before = result().at("residual_median");
  ASSERT_EQ(run(kUsual), 0);
  EXPECT_LT(result().at("residual_median").get<double>(), 0.5 * before);
}

TEST_F(RegisterTool, CorrespondenceSaysWhatAPointOfTheCloudIs) {
  ASSERT_EQ(run(kUsual), 0);
  const std::string usual = contents(at("out/deformed.ply"));
  ASSERT_EQ(run(std::string(kUsual) + "--correspondence surface"), 0) << contents(at("stderr"));
  EXPECT_EQ(contents(at("out/deformed.ply")), usual);
  ASSERT_EQ(run(std::string(kUsual) + "--correspondence points"), 0) << contents(at("stderr"));
  EXPECT_NE(contents(at("out/deformed.ply")), usual);
}

TEST_F(RegisterTool, RefusedRegistrationIsWrittenForTheEye) {
  EXPECT_EQ(run("organ.ply seen.ply --weights weights.safetensors --settings strict.yaml "
                "--output out"),
            3);
  const nlohmann::json json = result();
  EXPECT_EQ(json["status"], 1);
  EXPECT_GT(points("deformed.ply").cols(), 0);
  bool failed = false;
  for (const auto& check : json["checks"]) failed |= !check["passed"].get<bool>();
  EXPECT_TRUE(failed);
}

TEST_F(RegisterTool, SaysWhichResultCannotBeWritten) {
  fs::create_directories(at("out/rigid.ply"));
  EXPECT_EQ(run(kUsual), 1);
  EXPECT_NE(contents(at("stderr")).find("rigid.ply"), std::string::npos);
}

}  // namespace
}  // namespace unirit
