// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <gtest/gtest.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <sstream>
#include <string>

#include "shapes.hpp"
#include "unirit/io/surface_io.hpp"
#include "unirit/network/weights.hpp"
#include "unirit/simulation/depth_camera.hpp"
#include "unirit/simulation/phantom.hpp"

namespace unirit {

namespace fs = std::filesystem;

inline constexpr double kMillimetre = 0.001;

inline std::string contents(const fs::path& path) {
  std::ifstream file(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(file), {}};
}

/// Where the tool finds its inputs: a kidney before surgery, and seen by a camera 0.4 m away.
class RegisterTool : public ::testing::Test {
 protected:
  static void SetUpTestSuite() {
    folder() = fs::temp_directory_path() / ("unirit_register_" + std::to_string(::getpid()));
    fs::create_directories(folder());
    writeWeights(randomWeights(NetworkSettings().pairing, 1), at("weights.safetensors"));
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
          "max_surprise: 10, max_flip_gain: 10, max_displacement: 2, max_stretch: 100, "
          "min_compression: 0, max_folded: 1, max_turn: 180, max_joint: 10, min_overlap: 0}\n");
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

  /// The tool's exit status; what it prints lands in the files "stdout" and "stderr".
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

}  // namespace unirit
