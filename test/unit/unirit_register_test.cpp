// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <set>
#include <sstream>

#include "shapes.hpp"
#include "unirit/hash.hpp"
#include "unirit/io/surface_io.hpp"
#include "unirit/network/weights.hpp"
#include "unirit/simulation/depth_camera.hpp"
#include "unirit/simulation/phantom.hpp"

namespace unirit {
namespace {

namespace fs = std::filesystem;

constexpr double kMillimetre = 0.001;

std::string contents(const fs::path& path) {
  std::ifstream file(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(file), {}};
}

// Where the tool finds its inputs: a kidney before surgery, and seen by a camera 0.4 m away.
class RegisterTool : public ::testing::Test {
 protected:
  static void SetUpTestSuite() {
    folder() = fs::temp_directory_path() / ("unirit_register_" + std::to_string(::getpid()));
    fs::create_directories(folder());
    writeWeights(randomWeights(Pairing::kNearest, 1), at("weights.safetensors"));
    const Surface kidney = makePhantom("kidney", 1, 900);
    writePly(kidney, at("organ.ply"), kMillimetre);
    writePly(kidney, at("organ_in_metres.ply"), 1.0);
    writePly(test::box({0.1F, 0.08F, 0.05F}), at("box.ply"), kMillimetre);
    DepthCamera camera;
    camera.width = 160;
    camera.height = 120;
    const Eigen::Isometry3d pose = lookAt({0.3, 0.1, 0.2}, {0, 0, 0}, {0, 0, 1}).inverse();
    const Surface seen{renderDepth(kidney, pose, camera, 1), {}};
    writePly(seen, at("seen.ply"), kMillimetre);
    writePly(seen, at("seen_in_metres.ply"), 1.0);
    write("line.ply",
          "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty "
          "float z\nend_header\n0 0 0\n1 0 0\nnan 0 0\n");
    write("settings.yaml",
          "sampling: {points: 256}\nplausibility: {max_residual: 1, max_residual_p95: 1, "
          "min_inliers: 0, max_residual_left: 10, max_missing: 1, min_confidence: 0, "
          "max_surprise: 10, max_displacement: 2, max_stretch: 100, min_compression: 0, "
          "max_folded: 1, max_turn: 180, max_joint: 10, min_overlap: 0}\n");
    write("strict.yaml", "plausibility: {max_residual: 0}\n");
    write("wrong.yaml", "sampling: {point: 256}\n");
    write("broken.safetensors", "not weights");
  }

  static void TearDownTestSuite() { fs::remove_all(folder()); }

  void TearDown() override { fs::remove_all(at("out")); }

  static fs::path& folder() {
    static fs::path path;
    return path;
  }
  static std::string at(const std::string& name) { return (folder() / name).string(); }
  static void write(const std::string& name, const std::string& text) {
    std::ofstream(at(name)) << text;
  }

  // The tool's exit status; what it prints lands in the files "stdout" and "stderr".
  static int run(const std::string& arguments) {
    const std::string command =
        "cd " + folder().string() + " && " UNIRIT_REGISTER " " + arguments + " >stdout 2>stderr";
    const int status = std::system(command.c_str());
    return WIFEXITED(status) ? WEXITSTATUS(status) : -1;
  }

  static constexpr const char* kUsual =
      "organ.ply seen.ply --weights weights.safetensors --settings settings.yaml --output out ";

  static void writeSeenAsPcd(const std::string& name, const std::string& viewpoint) {
    const Points seen = readSurface(at("seen.ply"), 1.0).surface.vertices.points;
    std::ostringstream pcd;
    pcd << "VERSION 0.7\nFIELDS x y z\nSIZE 4 4 4\nTYPE F F F\nWIDTH " << seen.cols()
        << "\nHEIGHT 1\n"
        << viewpoint << "DATA ascii\n"
        << seen.transpose() << "\n";
    write(name, pcd.str());
  }

  static Points points(const std::string& name, double unit = kMillimetre) {
    return readSurface(at("out/" + name), unit).surface.vertices.points;
  }
  static nlohmann::json result() { return nlohmann::json::parse(contents(at("out/result.json"))); }

  static void expectRefusal(const std::string& arguments, const std::string& words) {
    SCOPED_TRACE(arguments);
    EXPECT_EQ(run(arguments), 2);
    const std::string sentence = contents(at("stderr"));
    EXPECT_EQ(std::count(sentence.begin(), sentence.end(), '\n'), 1) << sentence;
    EXPECT_NE(sentence.find(words), std::string::npos) << sentence;
    EXPECT_FALSE(fs::exists(at("out")));
    EXPECT_FALSE(fs::exists(at("result.json")));
  }
};

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

TEST_F(RegisterTool, GivesTheSameInMetresAsInMillimetres) {
  ASSERT_EQ(run(kUsual), 0);
  const Points millimetres = points("deformed.ply");
  ASSERT_EQ(run("organ_in_metres.ply seen_in_metres.ply --units m --weights weights.safetensors "
                "--settings settings.yaml --output out"),
            0);
  EXPECT_LT((points("deformed.ply", 1.0) - millimetres).cwiseAbs().maxCoeff(), 2e-5F);
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

TEST_F(RegisterTool, SamplesTheFacesOfACoarseMesh) {
  const std::string coarse =
      "box.ply box.ply --weights weights.safetensors --settings settings.yaml --output out --seed ";
  ASSERT_NE(run(coarse + "1"), 2) << contents(at("stderr"));
  EXPECT_EQ(points("deformed.ply").cols(), 8);
  const std::string first = contents(at("out/deformed.ply"));
  ASSERT_NE(run(coarse + "1"), 2);
  EXPECT_EQ(contents(at("out/deformed.ply")), first);
  ASSERT_NE(run(coarse + "2"), 2);
  EXPECT_NE(contents(at("out/deformed.ply")), first);
}

TEST_F(RegisterTool, RunsAllStagesUnlessToldOtherwise) {
  const auto ran = [](const char* stage) {
    const auto stages = result().at("stages").get<std::vector<std::string>>();
    return std::count(stages.begin(), stages.end(), stage) == 1;
  };
  ASSERT_EQ(run(kUsual), 0);
  EXPECT_TRUE(ran("rigid") && ran("nonrigid") && ran("refine"));
  ASSERT_EQ(run(std::string(kUsual) + "--stages rigid,refine"), 0) << contents(at("stderr"));
  EXPECT_TRUE(ran("rigid") && !ran("nonrigid") && ran("refine"));
  ASSERT_EQ(run(std::string(kUsual) + "--stages rigid,nonrigid"), 0);
  EXPECT_FALSE(ran("refine"));
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

TEST_F(RegisterTool, ViewpointIsThatOfTheCommandLineOrElseOfAPcd) {
  const std::string after = " --weights weights.safetensors --settings settings.yaml --output out ";
  const auto deformedWith = [&](const std::string& arguments) {
    EXPECT_EQ(run("organ.ply " + arguments + after), 0) << contents(at("stderr"));
    return contents(at("out/deformed.ply"));
  };
  writeSeenAsPcd("placed.pcd", "VIEWPOINT -20 0 5 1 0 0 0\n");
  writeSeenAsPcd("unplaced.pcd", "");
  const std::string unknown = deformedWith("unplaced.pcd");
  const std::string placed = deformedWith("placed.pcd");
  EXPECT_NE(placed, unknown);
  EXPECT_EQ(placed, deformedWith("unplaced.pcd --viewpoint -20 0 5"));
  EXPECT_EQ(placed, deformedWith("placed.pcd --viewpoint -2e1 -0 5.0"));
  EXPECT_NE(placed, deformedWith("placed.pcd --viewpoint 0 0 -900"));
}

TEST_F(RegisterTool, CountsWhatThePreprocessingLeaves) {
  Surface seen = readSurface(at("seen.ply"), kMillimetre).surface;
  const Eigen::Index size = seen.vertices.size();
  seen.vertices.points(1, 3) = std::nanf("");
  writePly(seen, at("holey.ply"), kMillimetre);
  ASSERT_EQ(run("organ.ply holey.ply --weights weights.safetensors --settings settings.yaml "
                "--output out"),
            0)
      << contents(at("stderr"));
  const nlohmann::json json = result();
  EXPECT_EQ(json["preprocessing_stages"],
            (std::vector<std::string>{"received", "valid", "outliers", "voxel"}));
  EXPECT_EQ(json["preprocessing_points"].size(), 4U);
  EXPECT_EQ(json["preprocessing_points"][0], size);
  EXPECT_EQ(json["preprocessing_points"][1], size - 1);
}

TEST_F(RegisterTool, RegionLeavesTheRestOut) {
  const Surface seen = readSurface(at("seen.ply"), kMillimetre).surface;
  Surface scene = seen;
  const Eigen::Index size = seen.vertices.size();
  scene.vertices.points.conservativeResize(Eigen::NoChange, 2 * size);
  scene.vertices.points.rightCols(size) =
      seen.vertices.points.colwise() + Eigen::Vector3f(0.0F, 0.0F, 0.4F);
  writePly(seen, at("alone.ply"), kMillimetre);
  writePly(scene, at("scene.ply"), kMillimetre);
  const std::string others =
      " --weights weights.safetensors --settings settings.yaml --output out ";
  ASSERT_EQ(run("organ.ply alone.ply" + others), 0);
  const std::string alone = contents(at("out/deformed.ply"));
  ASSERT_EQ(run("organ.ply scene.ply" + others + "--region 500 500 600 -500 -500 0"), 0)
      << contents(at("stderr"));
  EXPECT_TRUE(contents(at("out/deformed.ply")) == alone);
  const nlohmann::json json = result();
  EXPECT_EQ(json["preprocessing_stages"][2], "region");
  EXPECT_EQ(json["preprocessing_points"][1], 2 * size);
  EXPECT_EQ(json["preprocessing_points"][2], size);
  fs::remove_all(at("out"));
  expectRefusal("organ.ply scene.ply" + others + "--region 0 0 -2 1 1 -1",
                "preprocessing/region leaves 0 of");
}

TEST_F(RegisterTool, TurnsOrgansThatAreInsideOut) {
  Surface organ = readSurface(at("organ.ply"), kMillimetre).surface;
  ASSERT_EQ(run(kUsual), 0);
  const Points usual = points("deformed.ply");
  organ.faces.row(1).swap(organ.faces.row(2));
  writePly(organ, at("inside_out.ply"), kMillimetre);
  const std::string others =
      " seen.ply --weights weights.safetensors --settings settings.yaml --output out";
  ASSERT_EQ(run("inside_out.ply" + others), 0);
  EXPECT_EQ(readSurface(at("out/deformed.ply"), kMillimetre).surface.faces, organ.faces);
  EXPECT_LT((points("deformed.ply") - usual).cwiseAbs().maxCoeff(), 1e-5F);
}

TEST_F(RegisterTool, EstimatesTheNormalsOfABareCloud) {
  Surface organ = readSurface(at("organ.ply"), kMillimetre).surface;
  organ.faces.resize(3, 0);
  writePly(organ, at("cloud.ply"), kMillimetre);
  ASSERT_EQ(run("cloud.ply seen.ply --weights weights.safetensors --settings settings.yaml "
                "--output out"),
            0)
      << contents(at("stderr"));
  const Surface deformed = readSurface(at("out/deformed.ply"), kMillimetre).surface;
  EXPECT_EQ(deformed.vertices.size(), organ.vertices.size());
  EXPECT_EQ(deformed.faces.cols(), 0);
  EXPECT_LT(result().at("residual_median").get<double>(), 0.003);
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

TEST_F(RegisterTool, HelpAndVersionSucceed) {
  EXPECT_EQ(run("--help"), 0);
  EXPECT_NE(contents(at("stdout")).find("--viewpoint"), std::string::npos);
  EXPECT_EQ(run("--version"), 0);
  EXPECT_NE(contents(at("stdout")).find("unirit"), std::string::npos);
}

TEST_F(RegisterTool, MisuseIsOneSentenceAndNothingWritten) {
  const std::string usual = kUsual;
  const std::string output = " --weights weights.safetensors --output out";
  expectRefusal("", "PREOP");
  expectRefusal("organ.ply --output out", "INTRAOP");
  expectRefusal(usual + "third.ply", "third.ply");
  expectRefusal(usual + "--bogus", "--bogus");
  expectRefusal(usual + "--units km", "km");
  expectRefusal(usual + "--threads many", "--threads");
  expectRefusal(usual + "--threads 0", "threads");
  expectRefusal(usual + "--seed -1", "--seed");
  expectRefusal(usual + "--viewpoint 1 2", "--viewpoint");
  expectRefusal(usual + "--viewpoint 1 2 3 4", "4");
  expectRefusal(usual + "--viewpoint 1 2 x", "--viewpoint");
  expectRefusal(usual + "--viewpoint 1 2 nan", "--viewpoint");
  expectRefusal(usual + "--region 1 2 3 4 5", "--region");
  expectRefusal(usual + "--region 1 2 3 4 5 inf", "--region");
  expectRefusal(usual + "--stages rigid,refined", "'refined'");
  expectRefusal(usual + "--stages nonrigid,rigid", "order");
  expectRefusal(usual + "--correspondence lines", "'lines'");
  expectRefusal(usual + "--points missing.ply", "missing.ply");
  expectRefusal(usual + "--points line.ply", "not finite");
  expectRefusal("missing.ply seen.ply" + output, "missing.ply");
  expectRefusal("organ.ply line.ply" + output, "intra-operative");
  expectRefusal("line.ply seen.ply" + output, "pre-operative");
  expectRefusal("settings.yaml seen.ply" + output, "extension");
  expectRefusal("organ.ply seen_in_metres.ply" + output, "the intra-operative cloud's extent");
  expectRefusal("organ_in_metres.ply seen.ply" + output, "the pre-operative cloud's extent");
  expectRefusal("organ_in_metres.ply seen_in_metres.ply" + output, "read as millimetres");
  expectRefusal("organ.ply seen.ply --units m" + output, "read as metres");
  expectRefusal("organ.ply seen.ply --output out --weights missing.safetensors", "missing");
  expectRefusal("organ.ply seen.ply --output out --weights broken.safetensors", "broken");
  writeWeights(randomWeights(Pairing::kRow, 1), at("rows.safetensors"));
  expectRefusal("organ.ply seen.ply --output out --weights rows.safetensors", "row");
  expectRefusal("organ.ply seen.ply --settings wrong.yaml" + output, "sampling/point is not");
  expectRefusal("organ.ply seen.ply --settings missing.yaml" + output, "missing.yaml");
  expectRefusal("organ.ply seen.ply --weights weights.safetensors --output organ.ply", "--output");
}

}  // namespace
}  // namespace unirit
