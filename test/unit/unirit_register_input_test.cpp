// SPDX-License-Identifier: BSD-3-Clause
// What unirit_register takes, and what it refuses.
#include <cmath>

#include "register_tool.hpp"

namespace unirit {
namespace {

TEST_F(RegisterTool, GivesTheSameInMetresAsInMillimetres) {
  ASSERT_EQ(run(kUsual), 0);
  const Points millimetres = points("deformed.ply");
  ASSERT_EQ(run("organ_in_metres.ply seen_in_metres.ply --units m --weights weights.safetensors "
                "--settings settings.yaml --output out"),
            0);
  EXPECT_LT((points("deformed.ply", 1.0) - millimetres).cwiseAbs().maxCoeff(), 2e-5F);
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
  // From here the refinement alone ends beside the kidney: the network must bring it near
  ASSERT_EQ(run("cloud.ply seen.ply --weights " UNIRIT_SOURCE_DIR
                "/models/unirit.safetensors --settings settings.yaml --output out"),
            0)
      << contents(at("stderr"));
  const Surface deformed = readSurface(at("out/deformed.ply"), kMillimetre).surface;
  EXPECT_EQ(deformed.vertices.size(), organ.vertices.size());
  EXPECT_EQ(deformed.faces.cols(), 0);
  EXPECT_LT(result().at("residual_median").get<double>(), 0.003);
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
