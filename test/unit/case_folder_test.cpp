// SPDX-License-Identifier: BSD-3-Clause
#include "unirit/evaluation/case_folder.hpp"

#include <gtest/gtest.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>

#include "unirit/io/surface_io.hpp"
#include "unirit/metrics.hpp"
#include "unirit/simulation/phantom.hpp"

namespace unirit {
namespace {

namespace fs = std::filesystem;

constexpr double kMillimetre = 0.001;

/// A folder of cases as another program would write it, and the pair they were made from.
class CaseFolders : public ::testing::Test {
 protected:
  void SetUp() override {
    pair_ = makePair(makePhantom("kidney", 3, 800), Protocol::kPartial, 256, 5);
    root_ = fs::temp_directory_path() / ("unirit_cases_" + std::to_string(::getpid()));
    folder_ = root_ / "partial" / "kidney_tumor_a_1";
    fs::create_directories(folder_);
    write("source.ply", pair_.source, pair_.source_normals);
    write("target.ply", pair_.target);
    write("truth.ply", pair_.truth);
    write("points.ply", pair_.interior);
    write("points_truth.ply", pair_.interior_truth);
    write("surface.ply", pair_.surface);
    const Eigen::Vector3f eye = *pair_.viewpoint / static_cast<float>(kMillimetre);
    writeJson("{\"viewpoint\": [" + std::to_string(eye.x()) + ", " + std::to_string(eye.y()) +
              ", " + std::to_string(eye.z()) + "], \"rmse_before_mm\": " + before() + "}");
  }
  void TearDown() override { fs::remove_all(root_); }

  void write(const char* name, const Points& points, const Points& normals = {}) const {
    writePly({{points, normals}, {}}, (folder_ / name).string(), kMillimetre);
  }
  void writeJson(const std::string& text) const { std::ofstream(folder_ / "case.json") << text; }
  std::string before() const {
    return std::to_string(rootMeanSquareDistance(pair_.source, pair_.truth) / kMillimetre);
  }

  void expectRefusal(const std::string& file, const std::string& words) const {
    try {
      readCaseFolder(folder_.string());
      ADD_FAILURE() << "read a case that " << words;
    } catch (const std::runtime_error& error) {
      const std::string sentence = error.what();
      EXPECT_NE(sentence.find(file), std::string::npos) << sentence;
      EXPECT_NE(sentence.find(words), std::string::npos) << sentence;
    }
  }

  RegistrationPair pair_;
  fs::path root_, folder_;
};

TEST_F(CaseFolders, GiveBackThePairTheyWereMadeFrom) {
  const auto cases = listCaseFolders(root_.string());
  ASSERT_EQ(cases.size(), 1U);
  EXPECT_EQ(cases[0].protocol, "partial");
  EXPECT_EQ(cases[0].organ, "kidney_tumor");
  EXPECT_EQ(cases[0].subject, "a_1");
  const RegistrationPair read = readCaseFolder(cases[0].path);
  EXPECT_TRUE(read.source.isApprox(pair_.source, 1e-6F));
  EXPECT_TRUE(read.source_normals.isApprox(pair_.source_normals, 1e-6F));
  EXPECT_TRUE(read.target.isApprox(pair_.target, 1e-6F));
  EXPECT_TRUE(read.truth.isApprox(pair_.truth, 1e-6F));
  EXPECT_TRUE(read.interior.isApprox(pair_.interior, 1e-6F));
  EXPECT_TRUE(read.interior_truth.isApprox(pair_.interior_truth, 1e-6F));
  EXPECT_TRUE(read.surface.isApprox(pair_.surface, 1e-6F));
  EXPECT_TRUE(read.best_rigid.isApprox(pair_.best_rigid, 1e-5));
  ASSERT_TRUE(read.viewpoint.has_value());
  EXPECT_TRUE(read.viewpoint->isApprox(*pair_.viewpoint, 1e-6F));
}

TEST_F(CaseFolders, KnowNoViewpointWhereItIsNull) {
  writeJson("{\"viewpoint\": null, \"rmse_before_mm\": " + before() + "}");
  EXPECT_FALSE(readCaseFolder(folder_.string()).viewpoint.has_value());
}

TEST_F(CaseFolders, AreListedByProtocolOrganAndSubject) {
  for (const char* name : {"caseb/spleen_2", "caseb/liver_10", "caseb/liver_09"}) {
    fs::create_directories(root_ / name);
    std::ofstream(root_ / name / "case.json") << "{}";
  }
  fs::create_directories(root_ / "caseb" / "notes");  // no case.json: no case
  std::string listed;
  for (const CaseFolder& folder : listCaseFolders(root_.string())) {
    listed += folder.protocol + "/" + folder.organ + "/" + folder.subject + " ";
  }
  EXPECT_EQ(listed, "caseb/liver/09 caseb/liver/10 caseb/spleen/2 partial/kidney_tumor/a_1 ");
  EXPECT_THROW(listCaseFolders((root_ / "none").string()), std::runtime_error);
  EXPECT_THROW(listCaseFolders((root_ / "caseb" / "notes").string()), std::runtime_error);
}

TEST_F(CaseFolders, AreRefusedWithASentenceWhereTheyAreDamaged) {
  write("truth.ply", pair_.truth.leftCols(255));
  expectRefusal("truth.ply", "holds 255 points where 256");
  write("truth.ply", pair_.truth.rowwise().reverse());
  expectRefusal("case.json", "rows do not belong together");
  write("truth.ply", pair_.truth);
  write("points_truth.ply", pair_.interior_truth.leftCols(3));
  expectRefusal("points_truth.ply", "holds 3 points where 200");
  write("points_truth.ply", pair_.interior_truth);
  Points broken = pair_.target;
  broken(1, 7) = std::numeric_limits<float>::quiet_NaN();
  write("target.ply", broken);
  expectRefusal("target.ply", "not finite");
  write("target.ply", pair_.target);
  write("source.ply", pair_.source);
  expectRefusal("source.ply", "no normals");
  write("source.ply", pair_.source, pair_.source_normals);
  EXPECT_NO_THROW(readCaseFolder(folder_.string()));
  fs::remove(folder_ / "surface.ply");
  expectRefusal("surface.ply", "No such file");
}

TEST_F(CaseFolders, AreRefusedWithASentenceWhereTheirJsonIsWrong) {
  writeJson("{\"viewpoint\": [1, 2");
  expectRefusal("case.json", "not a JSON object");
  writeJson("{\"rmse_before_mm\": 1}");
  expectRefusal("case.json", "no \"viewpoint\"");
  writeJson("{\"viewpoint\": [1, 2], \"rmse_before_mm\": 1}");
  expectRefusal("case.json", "neither null nor three numbers");
  writeJson("{\"viewpoint\": null}");
  expectRefusal("case.json", "no number \"rmse_before_mm\"");
  fs::remove(folder_ / "case.json");
  expectRefusal("case.json", "is missing");
}

}  // namespace
}  // namespace unirit
