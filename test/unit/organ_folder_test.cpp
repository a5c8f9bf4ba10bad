// SPDX-License-Identifier: BSD-3-Clause
#include "unirit/io/organ_folder.hpp"

#include <gtest/gtest.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>

#include "shapes.hpp"
#include "unirit/io/surface_io.hpp"

namespace unirit {
namespace {

namespace fs = std::filesystem;

class OrganFolders : public ::testing::Test {
 protected:
  void SetUp() override {
    root_ = fs::temp_directory_path() / ("unirit_organs_" + std::to_string(::getpid()));
    fs::create_directories(root_);
  }
  void TearDown() override { fs::remove_all(root_); }

  void touch(const std::string& name) const {
    fs::create_directories((root_ / name).parent_path());
    std::ofstream(root_ / name) << "not a mesh";
  }

  std::string list(const std::string& folder) {
    left_out_.clear();
    std::string text;
    for (const OrganFile& file :
         listOrganFiles(folder, [&](const std::string& s) { left_out_ += s + "\n"; })) {
      text += file.organ + ":" + file.subject + " ";
    }
    return text;
  }

  fs::path root_;
  std::string left_out_;
};

TEST_F(OrganFolders, NameTheOrganByTheFolder) {
  for (const char* name : {"train/liver/spleen_like_1.ply", "test/Small_Intestine/a.STL",
                           "phantom_liver/7.obj", "spleen/b.pcd"}) {
    touch(name);
  }
  EXPECT_EQ(list(root_.string()), "phantom_liver:7 spleen:b small_bowel:a liver:spleen_like_1 ");
  EXPECT_EQ(left_out_, "");
  EXPECT_EQ(list((root_ / "spleen").string()), "spleen:b ");  // the root may be the organ's folder
  EXPECT_EQ(list(root_.string() + "/"), list(root_.string()));
}

TEST_F(OrganFolders, NameTheOrganByTheFileWhereTheFolderIsFlat) {
  for (const char* name : {"s0123_liver.stl", "000017_heart_atrium_left.ply", "x_GallBladder.obj",
                           "liver_spleen.stl", "femur.stl", "notes.txt", ".hidden.stl"}) {
    touch(name);
  }
  EXPECT_EQ(list(root_.string()),
            "atrium:000017_heart_atrium_left liver:s0123_liver gallbladder:x_GallBladder ");
  for (const char* words :
       {"liver_spleen.stl: its name is ambiguous: it names both liver and spleen",
        "femur.stl: its name names no organ of the table", "notes.txt: its extension is none of"}) {
    EXPECT_NE(left_out_.find(words), std::string::npos) << left_out_;
  }
  EXPECT_EQ(left_out_.find("hidden"), std::string::npos);
}

TEST_F(OrganFolders, FlatOnesMayLieDeeper) {
  for (const char* name : {"download/s1_liver.stl", "download/s1_liver_vessels.stl"}) touch(name);
  EXPECT_EQ(list(root_.string()), "liver:s1_liver ");
  EXPECT_NE(left_out_.find("ambiguous"), std::string::npos) << left_out_;
}

TEST_F(OrganFolders, KeepReadingAfterABadFile) {
  touch("liver/0_broken.ply");
  writePly(test::box({0.1F, 0.1F, 0.1F}), (root_ / "liver/1.ply").string(), 0.001);
  writePly({test::box({0.1F, 0.1F, 0.1F}).vertices, {}}, (root_ / "liver/2.ply").string(), 0.001);
  std::string left_out;
  const auto organs =
      readOrgans(root_.string(), 0.001, {}, [&](const std::string& s) { left_out += s + "\n"; });
  ASSERT_EQ(organs.size(), 1U);
  EXPECT_EQ(organs[0].subject, "1");
  EXPECT_NEAR(organs[0].surface.vertices.points.maxCoeff(), 0.1F, 1e-6F);
  EXPECT_NE(left_out.find("0_broken.ply"), std::string::npos) << left_out;
  EXPECT_NE(left_out.find("2.ply: has no faces"), std::string::npos) << left_out;
  EXPECT_TRUE(readOrgans(root_.string(), 0.001, {"liver"}, [](const auto&) {}).empty());
  EXPECT_THROW(list((root_ / "none").string()), std::runtime_error);
}

TEST_F(OrganFolders, MayBeLinksAndTellThoseThatLeadNowhere) {
  touch("elsewhere/a.ply");
  fs::create_directories(root_ / "organs");
  fs::create_directory_symlink(root_ / "elsewhere", root_ / "organs/liver");
  fs::create_symlink("nowhere.ply", root_ / "organs/x_spleen.ply");
  EXPECT_EQ(list((root_ / "organs").string()), "liver:a spleen:x_spleen ");
  const OrganFile leads_nowhere{"spleen", "x", (root_ / "organs/x_spleen.ply").string(), "x"};
  EXPECT_THROW(readOrganSurface(leads_nowhere, 0.001), std::runtime_error);
}

TEST_F(OrganFolders, HoldSurfacesWhoseFacesLookOutwards) {
  const Surface outwards = test::box({0.1F, 0.1F, 0.1F});
  Surface inwards = outwards;
  inwards.faces.row(1).swap(inwards.faces.row(2));
  for (const Surface& box : {outwards, inwards}) {
    const std::string path = (root_ / "box.ply").string();
    writePly(box, path, 0.001);
    EXPECT_EQ(readOrganSurface({"box", "box", path, "box.ply"}, 0.001).faces, outwards.faces);
  }
}

}  // namespace
}  // namespace unirit
